// See weights.h.

#include "post/weights.h"

#include "base/file.h"
#include "base/text.h"

#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static bool is_there(Text *path, const char *folder, size_t length, const char *rest, const char *name)
{
  text_clear(path);
  text_add_n(path, folder, length);
  text_add(path, "%s/%s", rest, name);
  return !path->failed && !access(text_get(path), R_OK);
}

static bool is_set(const char *variable)
{
  return variable && *variable;
}

static bool find_in_data_folders(Text *path, const char *name)
{
  const char *home = getenv("HOME"), *data = getenv("XDG_DATA_HOME"), *shared = getenv("XDG_DATA_DIRS");
  if (is_set(data) && is_there(path, data, strlen(data), "/rayfold", name)) return true;
  if (!is_set(data) && is_set(home) && is_there(path, home, strlen(home), "/.local/share/rayfold", name))
    return true;
  if (!is_set(shared)) shared = "/usr/local/share:/usr/share";
  for (const char *rest = shared; *rest;) {
    const size_t length = strcspn(rest, ":");
    if (length && is_there(path, rest, length, "/rayfold", name)) return true;
    rest += length + (rest[length] == ':');
  }
  return false;
}

static bool read_network(Unet *out, const char *path, Err *err)
{
  FileBytes file;
  Tza tza;
  if (!file_read(&file, path, err)) return false;
  const bool ok = tza_read(&tza, file.data, file.size, err) && unet_init(out, &tza, err);
  file_release(&file);
  return ok || err_where(err, "%s", path);
}

bool weights_load(Unet *out, const char *folder, const char *name, Err *err)
{
  Text path = {0};
  *out = (Unet){0};
  bool ok = folder ? is_there(&path, folder, strlen(folder), "", name) : find_in_data_folders(&path, name);
  if (!ok)
    err_set(err, ERR_NOT_FOUND,
            "the weights of the denoising network (%s) are not installed; tools/denoiser.sh in Rayfold's source "
            "fetches them into ~/.local/share/rayfold",
            name);
  ok = ok && read_network(out, text_get(&path), err);
  if (!ok) unet_finish(out);
  text_finish(&path);
  return ok;
}
