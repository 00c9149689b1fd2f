// MagicaVoxel files (vox.h): each placed model becomes an object, models placed more than once are shared. A voxel is ten
// centimetres wide.

#include "base/file.h"
#include "scene/vox.h"
#include "scene/scene.h"

#define VOX_CELL 0.1f // m

typedef struct Import {
  Scene *scene;
  const char *path;
  VoxFile file;
  int32_t *voxels; // model -> scene.voxels, -1: not made yet
  Err *err;
} Import;

static bool make_model(Import *m, uint32_t model)
{
  if (m->voxels[model] >= 0) return true;
  const SceneVoxels v = {.data = vox_model(&m->file, model, m->err)};
  if (!v.data) return false;
  m->voxels[model] = scene_add_voxels(m->scene, &v);
  return m->voxels[model] >= 0 || err_memory(m->err, m->path, 0);
}

// Where a point of the model's grid goes, both in our axes and in cells: there and back through the file's axes.
static void place_point(const VoxModel *model, const VoxPlace *p, const double at[3], double out[3])
{
  const double there[3] = {at[0], (double)model->size[1] - at[2], at[1]};
  double w[3];
  for (int k = 0; k < 3; k++) {
    const int j = p->axis[k];
    w[k] = p->sign[k] * (there[j] - model->size[j] / 2) + (double)p->at[k];
  }
  out[0] = w[0];
  out[1] = w[2];
  out[2] = -w[1];
}

static void place_object(const VoxModel *model, const VoxPlace *p, ObjectCommon *o)
{
  static const double origin[3] = {0, 0, 0};
  double from[3], to[3];
  bool is_turned = false;
  place_point(model, p, origin, from);
  for (int axis = 0; axis < 3; axis++) {
    double unit[3] = {0, 0, 0};
    unit[axis] = 1;
    place_point(model, p, unit, to);
    for (int k = 0; k < 3; k++) {
      o->matrix[3 * axis + k] = (float)(to[k] - from[k]);
      is_turned |= to[k] - from[k] != unit[k];
    }
  }
  for (int k = 0; k < 3; k++) o->matrix[9 + k] = o->translate[k] = VOX_CELL * (float)from[k];
  if (is_turned) memset(o->translate, 0, sizeof o->translate);
  else memset(o->matrix, 0, sizeof o->matrix);
}

static bool add_object(Import *m, const VoxPlace *p)
{
  if (!make_model(m, p->model)) return false;
  const char *name = p->name_size ? arena_text_n(&m->scene->arena, p->name, p->name_size) : NULL;
  const int32_t i = scene_add_object(m->scene, SHAPE_VOXELS, name);
  if (i < 0) return err_memory(m->err, m->path, sizeof(Object));
  Object *o = &m->scene->objects.items[i];
  o->shape.voxels_i = m->voxels[p->model];
  o->shape.voxels.voxel_size = VOX_CELL;
  place_object(&m->file.models.items[p->model], p, &o->common);
  return true;
}

bool import_vox(Scene *s, const char *path, const LoadOptions *options, Err *err)
{
  (void)options; // it names no others
  FileBytes bytes;
  if (!file_read(&bytes, path, err)) return false;
  Import m = {.scene = s, .path = path, .err = err};
  bool ok = vox_read(&m.file, path, (Span){bytes.data, bytes.size}, err);
  if (ok) {
    m.voxels = mem_alloc(m.file.models.count, sizeof *m.voxels);
    ok = m.voxels || err_memory(err, path, m.file.models.count * sizeof *m.voxels);
  }
  for (size_t i = 0; ok && i < m.file.models.count; i++) m.voxels[i] = -1;
  for (size_t i = 0; ok && i < m.file.places.count; i++) ok = add_object(&m, &m.file.places.items[i]);
  mem_free(m.voxels);
  vox_finish(&m.file);
  file_release(&bytes);
  return ok;
}

bool scene_load_voxels(Scene *s, const char *path, int32_t *voxels_i, Err *err)
{
  FileBytes bytes;
  VoxFile file = {0};
  SceneVoxels v = {.is_program = true};
  if (!file_read(&bytes, path, err)) return false;
  if (vox_read(&file, path, (Span){bytes.data, bytes.size}, err)) v.data = vox_merge(&file, path, NULL, err);
  vox_finish(&file);
  file_release(&bytes);
  if (!v.data) return false;
  *voxels_i = scene_add_voxels(s, &v);
  return *voxels_i >= 0 || err_memory(err, path, 0);
}
