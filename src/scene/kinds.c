// See kinds.h: the tables themselves, made from the rows of scene.h.

#include "scene/kinds.h"

#include <string.h>

#define COUNT(a) (sizeof(a) / sizeof *(a))

#define FIELD_OWNER About
static const Field about_fields[] = {ABOUT_FIELDS(FIELD_ROW)};
#undef FIELD_OWNER
#define FIELD_OWNER RenderSettings
static const Field render_fields[] = {RENDER_FIELDS(FIELD_ROW)};
#undef FIELD_OWNER
#define FIELD_OWNER WhittedSettings
static const Field whitted_fields[] = {WHITTED_FIELDS(FIELD_ROW)};
#undef FIELD_OWNER
#define FIELD_OWNER DevelopSettings
static const Field develop_fields[] = {DEVELOP_FIELDS(FIELD_ROW)};
#undef FIELD_OWNER
#define FIELD_OWNER CameraCommon
static const Field camera_fields[] = {CAMERA_FIELDS(FIELD_ROW)};
#undef FIELD_OWNER
#define FIELD_OWNER Perspective
static const Field perspective_fields[] = {PERSPECTIVE_FIELDS(FIELD_ROW)};
#undef FIELD_OWNER
#define FIELD_OWNER Orthographic
static const Field orthographic_fields[] = {ORTHOGRAPHIC_FIELDS(FIELD_ROW)};
#undef FIELD_OWNER
#define FIELD_OWNER Panoramic
static const Field panoramic_fields[] = {PANORAMIC_FIELDS(FIELD_ROW)};
#undef FIELD_OWNER
#define FIELD_OWNER SkyConstant
static const Field sky_constant_fields[] = {SKY_CONSTANT_FIELDS(FIELD_ROW)};
#undef FIELD_OWNER
#define FIELD_OWNER SkyGradient
static const Field sky_gradient_fields[] = {SKY_GRADIENT_FIELDS(FIELD_ROW)};
#undef FIELD_OWNER
#define FIELD_OWNER SkyImage
static const Field sky_image_fields[] = {SKY_IMAGE_FIELDS(FIELD_ROW)};
#undef FIELD_OWNER
#define FIELD_OWNER SkySun
static const Field sky_sun_fields[] = {SKY_SUN_FIELDS(FIELD_ROW)};
#undef FIELD_OWNER
#define FIELD_OWNER CellCommon
static const Field cell_fields[] = {CELL_FIELDS(FIELD_ROW)};
#undef FIELD_OWNER
#define FIELD_OWNER CellFlat
static const Field cell_flat_fields[] = {CELL_FLAT_FIELDS(FIELD_ROW)};
#undef FIELD_OWNER
#define FIELD_OWNER CellSpherical
static const Field cell_spherical_fields[] = {CELL_SPHERICAL_FIELDS(FIELD_ROW)};
#undef FIELD_OWNER
#define FIELD_OWNER CellHyperbolic
static const Field cell_hyperbolic_fields[] = {CELL_HYPERBOLIC_FIELDS(FIELD_ROW)};
#undef FIELD_OWNER
#define FIELD_OWNER GateCommon
static const Field gate_fields[] = {GATE_FIELDS(FIELD_ROW)};
#undef FIELD_OWNER
#define FIELD_OWNER GateRect
static const Field gate_rect_fields[] = {GATE_RECT_FIELDS(FIELD_ROW)};
#undef FIELD_OWNER
#define FIELD_OWNER GatePolygon
static const Field gate_polygon_fields[] = {GATE_POLYGON_FIELDS(FIELD_ROW)};
#undef FIELD_OWNER
#define FIELD_OWNER GateBox
static const Field gate_box_fields[] = {GATE_BOX_FIELDS(FIELD_ROW)};
#undef FIELD_OWNER
#define FIELD_OWNER GateSphere
static const Field gate_sphere_fields[] = {GATE_SPHERE_FIELDS(FIELD_ROW)};
#undef FIELD_OWNER
#define FIELD_OWNER GateWormhole
static const Field gate_wormhole_fields[] = {GATE_WORMHOLE_FIELDS(FIELD_ROW)};
#undef FIELD_OWNER
#define FIELD_OWNER GateBlackHole
static const Field gate_black_hole_fields[] = {GATE_BLACK_HOLE_FIELDS(FIELD_ROW)};
#undef FIELD_OWNER
#define FIELD_OWNER LightCommon
static const Field light_fields[] = {LIGHT_FIELDS(FIELD_ROW)};
#undef FIELD_OWNER
#define FIELD_OWNER TextureCommon
static const Field texture_fields[] = {TEXTURE_FIELDS(FIELD_ROW)};
#undef FIELD_OWNER
#define FIELD_OWNER TextureImage
static const Field texture_image_fields[] = {TEXTURE_IMAGE_FIELDS(FIELD_ROW)};
#undef FIELD_OWNER
#define FIELD_OWNER TextureChecker
static const Field texture_checker_fields[] = {TEXTURE_CHECKER_FIELDS(FIELD_ROW)};
#undef FIELD_OWNER
#define FIELD_OWNER TextureNoise
static const Field texture_noise_fields[] = {TEXTURE_NOISE_FIELDS(FIELD_ROW)};
#undef FIELD_OWNER
#define FIELD_OWNER TextureGradient
static const Field texture_gradient_fields[] = {TEXTURE_GRADIENT_FIELDS(FIELD_ROW)};
#undef FIELD_OWNER
#define FIELD_OWNER TextureBrick
static const Field texture_brick_fields[] = {TEXTURE_BRICK_FIELDS(FIELD_ROW)};
#undef FIELD_OWNER
#define FIELD_OWNER TextureWave
static const Field texture_wave_fields[] = {TEXTURE_WAVE_FIELDS(FIELD_ROW)};
#undef FIELD_OWNER
#define FIELD_OWNER Pbr
static const Field pbr_fields[] = {PBR_FIELDS(FIELD_ROW)};
#undef FIELD_OWNER
#define FIELD_OWNER Lambert
static const Field lambert_fields[] = {LAMBERT_FIELDS(FIELD_ROW)};
#undef FIELD_OWNER
#define FIELD_OWNER Mirror
static const Field mirror_fields[] = {MIRROR_FIELDS(FIELD_ROW)};
#undef FIELD_OWNER
#define FIELD_OWNER Glass
static const Field glass_fields[] = {GLASS_FIELDS(FIELD_ROW)};
#undef FIELD_OWNER
#define FIELD_OWNER Emission
static const Field emission_fields[] = {EMISSION_FIELDS(FIELD_ROW)};
#undef FIELD_OWNER
#define FIELD_OWNER Principled
static const Field principled_fields[] = {PRINCIPLED_FIELDS(FIELD_ROW)};
#undef FIELD_OWNER
#define FIELD_OWNER Phong
static const Field phong_fields[] = {PHONG_FIELDS(FIELD_ROW)};
#undef FIELD_OWNER
#define FIELD_OWNER CookTorrance
static const Field cook_torrance_fields[] = {COOK_TORRANCE_FIELDS(FIELD_ROW)};
#undef FIELD_OWNER
#define FIELD_OWNER Studio
static const Field studio_fields[] = {STUDIO_FIELDS(FIELD_ROW)};
#undef FIELD_OWNER
#define FIELD_OWNER Mix
static const Field mix_fields[] = {MIX_FIELDS(FIELD_ROW)};
#undef FIELD_OWNER
#define FIELD_OWNER MediumCommon
static const Field medium_fields[] = {MEDIUM_FIELDS(FIELD_ROW)};
#undef FIELD_OWNER
#define FIELD_OWNER MediumGrid
static const Field medium_grid_fields[] = {MEDIUM_GRID_FIELDS(FIELD_ROW)};
#undef FIELD_OWNER
#define FIELD_OWNER MediumBall
static const Field medium_ball_fields[] = {MEDIUM_BALL_FIELDS(FIELD_ROW)};
#undef FIELD_OWNER
#define FIELD_OWNER MediumCloud
static const Field medium_cloud_fields[] = {MEDIUM_CLOUD_FIELDS(FIELD_ROW)};
#undef FIELD_OWNER
#define FIELD_OWNER MediumWisps
static const Field medium_wisps_fields[] = {MEDIUM_WISPS_FIELDS(FIELD_ROW)};
#undef FIELD_OWNER
#define FIELD_OWNER MediumFlame
static const Field medium_flame_fields[] = {MEDIUM_FLAME_FIELDS(FIELD_ROW)};
#undef FIELD_OWNER
#define FIELD_OWNER ObjectCommon
static const Field object_fields[] = {OBJECT_FIELDS(FIELD_ROW)};
#undef FIELD_OWNER
#define FIELD_OWNER ShapeMesh
static const Field shape_mesh_fields[] = {SHAPE_MESH_FIELDS(FIELD_ROW)};
#undef FIELD_OWNER
#define FIELD_OWNER ShapeSphere
static const Field shape_sphere_fields[] = {SHAPE_SPHERE_FIELDS(FIELD_ROW)};
#undef FIELD_OWNER
#define FIELD_OWNER ShapeQuad
static const Field shape_quad_fields[] = {SHAPE_QUAD_FIELDS(FIELD_ROW)};
#undef FIELD_OWNER
#define FIELD_OWNER ShapeDisk
static const Field shape_disk_fields[] = {SHAPE_DISK_FIELDS(FIELD_ROW)};
#undef FIELD_OWNER
#define FIELD_OWNER ShapeBox
static const Field shape_box_fields[] = {SHAPE_BOX_FIELDS(FIELD_ROW)};
#undef FIELD_OWNER
#define FIELD_OWNER ShapeTriangle
static const Field shape_triangle_fields[] = {SHAPE_TRIANGLE_FIELDS(FIELD_ROW)};
#undef FIELD_OWNER
#define FIELD_OWNER ShapeCylinder
static const Field shape_cylinder_fields[] = {SHAPE_CYLINDER_FIELDS(FIELD_ROW)};
#undef FIELD_OWNER
#define FIELD_OWNER ShapeCone
static const Field shape_cone_fields[] = {SHAPE_CONE_FIELDS(FIELD_ROW)};
#undef FIELD_OWNER
#define FIELD_OWNER ShapeEndlessCone
static const Field shape_endless_cone_fields[] = {SHAPE_ENDLESS_CONE_FIELDS(FIELD_ROW)};
#undef FIELD_OWNER
#define FIELD_OWNER ShapeTorus
static const Field shape_torus_fields[] = {SHAPE_TORUS_FIELDS(FIELD_ROW)};
#undef FIELD_OWNER
#define FIELD_OWNER ShapeCsg
static const Field shape_csg_fields[] = {SHAPE_CSG_FIELDS(FIELD_ROW)};
#undef FIELD_OWNER
#define FIELD_OWNER ShapeVoxels
static const Field shape_voxels_fields[] = {SHAPE_VOXELS_FIELDS(FIELD_ROW)};
#undef FIELD_OWNER
#define FIELD_OWNER VoxelFields
static const Field voxel_fields[] = {VOXEL_FIELDS(FIELD_ROW)};
#undef FIELD_OWNER
#define FIELD_OWNER VoxelStepFields
static const Field voxel_step_fields[] = {VOXEL_STEP_FIELDS(FIELD_ROW)};
#undef FIELD_OWNER
#define FIELD_OWNER VoxelBox
static const Field voxel_box_fields[] = {VOXEL_BOX_FIELDS(FIELD_ROW)};
#undef FIELD_OWNER
#define FIELD_OWNER VoxelSphere
static const Field voxel_sphere_fields[] = {VOXEL_SPHERE_FIELDS(FIELD_ROW)};
#undef FIELD_OWNER
#define FIELD_OWNER VoxelStroke
static const Field voxel_line_fields[] = {VOXEL_LINE_FIELDS(FIELD_ROW)};
#undef FIELD_OWNER
#define FIELD_OWNER VoxelCylinder
static const Field voxel_cylinder_fields[] = {VOXEL_CYLINDER_FIELDS(FIELD_ROW)};
#undef FIELD_OWNER
#define FIELD_OWNER VoxelHills
static const Field voxel_hills_fields[] = {VOXEL_HILLS_FIELDS(FIELD_ROW)};
#undef FIELD_OWNER
#define FIELD_OWNER VoxelHeights
static const Field voxel_heights_fields[] = {VOXEL_HEIGHTS_FIELDS(FIELD_ROW)};
#undef FIELD_OWNER
#define FIELD_OWNER VoxelFlood
static const Field voxel_flood_fields[] = {VOXEL_FLOOD_FIELDS(FIELD_ROW)};
#undef FIELD_OWNER
#define FIELD_OWNER VoxelExtrude
static const Field voxel_extrude_fields[] = {VOXEL_EXTRUDE_FIELDS(FIELD_ROW)};
#undef FIELD_OWNER
#define FIELD_OWNER VoxelReplace
static const Field voxel_replace_fields[] = {VOXEL_REPLACE_FIELDS(FIELD_ROW)};
#undef FIELD_OWNER
#define FIELD_OWNER ShapeField
static const Field shape_field_fields[] = {SHAPE_FIELD_FIELDS(FIELD_ROW)};
#undef FIELD_OWNER
#define FIELD_OWNER ShapeRoundBox
static const Field shape_round_box_fields[] = {SHAPE_ROUND_BOX_FIELDS(FIELD_ROW)};
#undef FIELD_OWNER
#define FIELD_OWNER ShapeCapsule
static const Field shape_capsule_fields[] = {SHAPE_CAPSULE_FIELDS(FIELD_ROW)};
#undef FIELD_OWNER
#define FIELD_OWNER ShapeEllipsoid
static const Field shape_ellipsoid_fields[] = {SHAPE_ELLIPSOID_FIELDS(FIELD_ROW)};
#undef FIELD_OWNER
#define FIELD_OWNER ShapeOctahedron
static const Field shape_octahedron_fields[] = {SHAPE_OCTAHEDRON_FIELDS(FIELD_ROW)};
#undef FIELD_OWNER
#define FIELD_OWNER ShapeMenger
static const Field shape_menger_fields[] = {SHAPE_MENGER_FIELDS(FIELD_ROW)};
#undef FIELD_OWNER
#define FIELD_OWNER ShapeMandelbulb
static const Field shape_mandelbulb_fields[] = {SHAPE_MANDELBULB_FIELDS(FIELD_ROW)};
#undef FIELD_OWNER
#define FIELD_OWNER ShapeFormula
static const Field shape_formula_fields[] = {SHAPE_FORMULA_FIELDS(FIELD_ROW)};
#undef FIELD_OWNER
#define FIELD_OWNER LightPoint
static const Field light_point_fields[] = {LIGHT_POINT_FIELDS(FIELD_ROW)};
#undef FIELD_OWNER
#define FIELD_OWNER LightSpot
static const Field light_spot_fields[] = {LIGHT_SPOT_FIELDS(FIELD_ROW)};
#undef FIELD_OWNER
#define FIELD_OWNER LightSun
static const Field light_sun_fields[] = {LIGHT_SUN_FIELDS(FIELD_ROW)};
#undef FIELD_OWNER
#define FIELD_OWNER LightRect
static const Field light_rect_fields[] = {LIGHT_RECT_FIELDS(FIELD_ROW)};
#undef FIELD_OWNER
#define FIELD_OWNER LightDisk
static const Field light_disk_fields[] = {LIGHT_DISK_FIELDS(FIELD_ROW)};
#undef FIELD_OWNER
#define FIELD_OWNER LightSphere
static const Field light_sphere_fields[] = {LIGHT_SPHERE_FIELDS(FIELD_ROW)};
#undef FIELD_OWNER
#define FIELD_OWNER Timeline
static const Field timeline_fields[] = {TIMELINE_FIELDS(FIELD_ROW)};
#undef FIELD_OWNER
#define FIELD_OWNER TrackFields
static const Field track_fields[] = {TRACK_FIELDS(FIELD_ROW)};
#undef FIELD_OWNER

#define KIND(name, fields, sentence) {name, fields, COUNT(fields), sentence}

static const Kind about_kinds[] = {KIND("about", about_fields, "")};
static const Kind render_kinds[] = {KIND("render", render_fields, "")};
static const Kind whitted_kinds[] = {KIND("whitted", whitted_fields, "")};
static const Kind develop_kinds[] = {KIND("develop", develop_fields, "")};
static const Kind camera_kinds[] = {
    KIND("perspective", perspective_fields, "A thin lens: near things are larger, and blurred when out of focus."),
    KIND("orthographic", orthographic_fields, "Parallel rays: size does not depend on distance."),
    KIND("panoramic", panoramic_fields, "All directions around the eye, as an equirectangular picture."),
};
static const Kind sky_kinds[] = {
    KIND("constant", sky_constant_fields, "The same from everywhere."),
    KIND("gradient", sky_gradient_fields, "From ground over horizon to zenith."),
    KIND("image", sky_image_fields, "A picture of all directions, sampled by its brightness."),
    KIND("sun_sky", sky_sun_fields, "The clear sky of any hour, with its sun."),
};
static const Kind cell_kinds[] = {
    KIND("flat", cell_flat_fields, "Space as we know it."),
    KIND("spherical", cell_spherical_fields, "Space that closes on itself: straight lines meet again."),
    KIND("hyperbolic", cell_hyperbolic_fields, "Space with more room than it should have: straight lines part."),
};
static const Kind gate_kinds[] = {
    KIND("rect", gate_rect_fields, "A rectangle."),
    KIND("polygon", gate_polygon_fields, "A flat outline of straight sides."),
    KIND("box", gate_box_fields, "All six sides of a box: its inside lies elsewhere."),
    KIND("sphere", gate_sphere_fields, "A ball whose inside lies elsewhere."),
    KIND("wormhole", gate_wormhole_fields, "A ball in flat space through which one comes out of another, and sees all of what is around that."),
    KIND("black_hole", gate_black_hole_fields, "A ball in flat space with a black hole in its middle, and matter that falls into it. Leads nowhere."),
};
static const Kind texture_kinds[] = {
    KIND("image", texture_image_fields, "A picture file."),
    KIND("checker", texture_checker_fields, "Two colours in fields."),
    KIND("noise", texture_noise_fields, "Clouds of several sizes: gradient noise."),
    KIND("gradient", texture_gradient_fields, "From one colour to another."),
    KIND("brick", texture_brick_fields, "A wall of bricks."),
    KIND("wave", texture_wave_fields, "Soft bands."),
};
static const Kind material_kinds[] = {
    KIND("pbr", pbr_fields, "The metallic-roughness model of glTF 2.0 with its common extensions."),
    KIND("lambert", lambert_fields, "Perfectly matt."),
    KIND("mirror", mirror_fields, "Perfectly smooth metal of one reflectance."),
    KIND("glass", glass_fields, "A clear solid with exact Fresnel reflection and refraction."),
    KIND("emission", emission_fields, "Shines, reflects nothing."),
    KIND("principled", principled_fields, "Blender's Principled BSDF by its names, as far as pbr can follow."),
    KIND("phong", phong_fields, "A matt body with Phong's highlight, in the form that gains no energy (Lafortune and Willems 1994)."),
    KIND("cook_torrance", cook_torrance_fields, "A matt body under facets (Cook and Torrance 1982), in the form that gains no energy."),
    KIND("studio", studio_fields, "The sliders of the first studio, by their names; each is monotone over its range."),
    KIND("mix", mix_fields, "Two other materials, each in part."),
};
static const Kind medium_kinds[] = {
    {"homogeneous", NULL, 0, "The same everywhere."},
    KIND("grid", medium_grid_fields, "A density from a file, mixed between its values."),
    KIND("ball", medium_ball_fields, "A ball that thins out, with waves in it."),
    KIND("cloud", medium_cloud_fields, "An ellipsoid of lumps, made of noise."),
    KIND("wisps", medium_wisps_fields, "Thin sheets of smoke, drawn out by whirls."),
    KIND("flame", medium_flame_fields, "A flame, torn by whirls, hottest in its middle. Give it `temperature`, `glow` and `absorption`."),
};
static const Kind object_kinds[] = {{"object", NULL, 0, ""}};
static const Kind shape_kinds[] = {
    KIND("mesh", shape_mesh_fields, "Triangles from a file, or given as positions, triangles, normals and texcoords."),
    KIND("sphere", shape_sphere_fields, "An exact sphere."),
    KIND("quad", shape_quad_fields, "A rectangle."),
    KIND("disk", shape_disk_fields, "A flat disk."),
    KIND("box", shape_box_fields, "A box."),
    {"plane", NULL, 0, "An endless plane through the origin, facing +z; uv are its x and y in metres."},
    KIND("triangle", shape_triangle_fields, "One triangle, its front where the corners run counter-clockwise."),
    KIND("cylinder", shape_cylinder_fields, "An exact cylinder."),
    KIND("cone", shape_cone_fields, "An exact cone, or what is left of one without its tip."),
    KIND("endless_cone", shape_endless_cone_fields, "A cone that goes on for ever."),
    KIND("torus", shape_torus_fields, "A ring."),
    KIND("csg", shape_csg_fields, "A body made of others: objects that name this one in part_of, in their order."),
    KIND("voxels", shape_voxels_fields, "A grid of small cubes, from a file or built by a program. See docs/voxels.md."),
    KIND("field", shape_field_fields, "A distance field: shapes that name this one in part_of, melted together, repeated, twisted, bent. Parts may be fields, spheres, boxes, planes, capped cylinders and cones, tori, and the kinds below."),
    KIND("round_box", shape_round_box_fields, "A box with round edges, as a distance field."),
    KIND("capsule", shape_capsule_fields, "A tube with round ends, as a distance field."),
    KIND("ellipsoid", shape_ellipsoid_fields, "An ellipsoid, as a distance field."),
    KIND("octahedron", shape_octahedron_fields, "Two pyramids, as a distance field."),
    KIND("menger", shape_menger_fields, "Menger's sponge: a cube with ever smaller square holes."),
    KIND("mandelbulb", shape_mandelbulb_fields, "A fractal with three dimensions (White and Nylander 2009)."),
    KIND("formula", shape_formula_fields, "A distance field by a formula of your own."),
};
static const Kind voxel_kinds[] = {KIND("voxel", voxel_fields, "")};
static const Kind voxel_step_kinds[] = {
    KIND("box", voxel_box_fields, "A box."),
    KIND("sphere", voxel_sphere_fields, "A ball."),
    KIND("line", voxel_line_fields, "A round line."),
    KIND("cylinder", voxel_cylinder_fields, "An upright cylinder, or what is left of a cone."),
    KIND("hills", voxel_hills_fields, "Hills of noise."),
    KIND("heights", voxel_heights_fields, "A land whose heights are a picture's."),
    KIND("flood", voxel_flood_fields, "Cells that hang together."),
    KIND("extrude", voxel_extrude_fields, "A face drawn out or pushed in; what comes out is of its own entry unless `voxel` says otherwise."),
    KIND("replace", voxel_replace_fields, "All cells of one entry, or all that are filled."),
};
static const Kind light_kinds[] = {
    KIND("point", light_point_fields, "A point that shines in all directions."),
    KIND("spot", light_spot_fields, "A point that shines into a cone."),
    KIND("sun", light_sun_fields, "Light from infinitely far, from a disk in the sky."),
    KIND("rect", light_rect_fields, "A rectangle that shines on its front."),
    KIND("disk", light_disk_fields, "A disk that shines on its front."),
    KIND("sphere", light_sphere_fields, "A shining sphere."),
};
static const Kind timeline_kinds[] = {KIND("timeline", timeline_fields, "")};
static const Kind track_kinds[] = {KIND("track", track_fields, "")};

#define FIELDS(table, member, Type) .common = table, .common_count = COUNT(table), .common_offset = offsetof(Type, member)
#define KINDS(table, first, Type) \
  .has_kind = true, .kind_offset = offsetof(Type, kind), .union_offset = offsetof(Type, first), .kinds = table, \
  .kind_count = COUNT(table)
#define ONE_KIND(table) .kinds = table, .kind_count = COUNT(table)

const Group group_about = {"about", "about", sizeof(About), ONE_KIND(about_kinds),
                           .sentence = "What the scene is, for people: shown when it is opened in the window."};
const Group group_render = {"render", "render settings", sizeof(RenderSettings), ONE_KIND(render_kinds),
                            .sentence = "How the picture is made."};
const Group group_whitted = {"whitted", "whitted settings", sizeof(WhittedSettings), ONE_KIND(whitted_kinds),
                             .sentence = "How the integrator `whitted` lights; the others do not look at it."};
const Group group_develop = {"develop", "develop settings", sizeof(DevelopSettings), ONE_KIND(develop_kinds),
                             .sentence = "From light to the screen; float files do not see it."};
const Group group_camera = {"camera", "camera", sizeof(Camera), .has_name = true, .kind_optional = true,
                            FIELDS(camera_fields, common, Camera), KINDS(camera_kinds, perspective, Camera),
                            .sentence = "The eye. More of them, by name, stand in \"cameras\"."};
const Group group_cameras = {"cameras", "camera", sizeof(Camera), .has_name = true, .kind_optional = true,
                             FIELDS(camera_fields, common, Camera), KINDS(camera_kinds, perspective, Camera),
                             .sentence = "More cameras, by name."};
const Group group_sky = {"sky", "sky", sizeof(Sky), KINDS(sky_kinds, constant, Sky),
                         .sentence = "What is seen where nothing is, and the light it gives."};
const Group group_skies = {"skies", "sky", sizeof(NamedSky), .has_name = true, .has_kind = true,
                           .kind_offset = offsetof(NamedSky, sky.kind), .union_offset = offsetof(NamedSky, sky.constant),
                           .kinds = sky_kinds, .kind_count = COUNT(sky_kinds), .sentence = "More skies, by name, for cells."};
const Group group_cell = {"cells", "cell", sizeof(Cell), .has_name = true, .kind_optional = true,
                          FIELDS(cell_fields, common, Cell), KINDS(cell_kinds, flat, Cell),
                          .sentence = "Spaces of their own, by name, that gates lead to. See docs/worlds.md."};
const Group group_gate = {"gates", "gate", sizeof(Gate), .has_name = true,
                          FIELDS(gate_fields, common, Gate), KINDS(gate_kinds, rect, Gate),
                          .sentence = "Doors from one place to another, by name."};
const Group group_texture = {"textures", "texture", sizeof(Texture), .has_name = true,
                             FIELDS(texture_fields, common, Texture), KINDS(texture_kinds, image, Texture),
                             .sentence = "Pictures and patterns for materials, by name."};
const Group group_material = {"materials", "material", sizeof(Material), .has_name = true,
                              KINDS(material_kinds, pbr, Material),
                              .sentence = "What surfaces are made of, by name."};
const Group group_medium = {"media", "medium", sizeof(Medium), .has_name = true,
                            FIELDS(medium_fields, common, Medium), KINDS(medium_kinds, grid, Medium),
                            .sentence = "What fills space: fog, smoke, clouds, by name. See docs/media.md."};
const Group group_shape = {"shape", "shape", sizeof(Shape), KINDS(shape_kinds, mesh, Shape),
                           .sentence = "An object's form."};
const Group group_object = {"objects", "object", sizeof(Object), .has_name = true,
                            FIELDS(object_fields, common, Object), ONE_KIND(object_kinds),
                            .nested = &group_shape, .nested_offset = offsetof(Object, shape),
                            .sentence = "A list of things: a shape, a material, a place."};
const Group group_light = {"lights", "light", sizeof(Light), .has_name = true,
                           FIELDS(light_fields, common, Light), KINDS(light_kinds, point, Light),
                           .sentence = "A list of lights; objects with an emissive material are lights, too."};
const Group group_timeline = {"timeline", "timeline", sizeof(Timeline), ONE_KIND(timeline_kinds),
                              .sentence = "Which moments there are."};
const Group group_track = {"animation", "track", sizeof(Track), .has_name = true,
                           ONE_KIND(track_kinds), .union_offset = offsetof(Track, fields),
                           .sentence = "A list of tracks: what moves, and how."};

const Group group_voxel = {"palette", "voxel", sizeof(VoxelFields), .common_offset = 0, ONE_KIND(voxel_kinds),
                           .sentence = "Kinds of voxels, by name."};
const Group group_voxel_step = {"fill", "step", sizeof(VoxelStep),
                                FIELDS(voxel_step_fields, common, VoxelStep), KINDS(voxel_step_kinds, box, VoxelStep),
                                .sentence = "Steps that fill the grid, one after the other."};

_Static_assert(!offsetof(Camera, name) && !offsetof(Texture, name) && !offsetof(Material, name) &&
                   !offsetof(Medium, name) &&
                   !offsetof(Object, name) && !offsetof(Light, name) &&
                   !offsetof(Track, name),
               "has_name means that the name comes first");

void group_default(const Group *g, int32_t kind, void *object)
{
  memset(object, 0, g->size);
  if (g->has_kind) *(int32_t *)((char *)object + g->kind_offset) = kind;
  if (g->common_count) fields_default(g->common, g->common_count, (char *)object + g->common_offset);
  const Kind *k = &g->kinds[g->has_kind ? kind : 0];
  if (k->field_count) fields_default(k->fields, k->field_count, (char *)object + g->union_offset);
  if (g->nested) group_default(g->nested, 0, group_nested(g, object));
  if (g == &group_shape) ((Shape *)object)->mesh_i = ((Shape *)object)->model_i = ((Shape *)object)->voxels_i = -1;
}

const Field *group_field_at(const Group *g, const void *object, size_t i, void **at)
{
  const Kind *k = group_kind(g, object);
  const bool is_common = i < g->common_count;
  if (!is_common) i -= g->common_count;
  if (!is_common && i >= k->field_count) return NULL;
  const Field *f = is_common ? &g->common[i] : &k->fields[i];
  if (at) *at = group_field(g, object, f, is_common);
  return f;
}

const Field *group_find_field(const Group *g, const void *object, const char *name, void **at)
{
  const Field *f;
  for (size_t i = 0; (f = group_field_at(g, object, i, at)); i++)
    if (!strcmp(f->name, name)) return f;
  return NULL;
}

void *group_nested(const Group *g, const void *object)
{
  return g->nested ? (char *)(size_t)object + g->nested_offset : NULL;
}

const char **group_name(const Group *g, const void *object)
{
  return g->has_name ? (const char **)(size_t)object : NULL;
}

bool group_is_listed(const Group *g)
{
  return g == &group_object || g == &group_light || g == &group_track;
}

const Kind *group_kind(const Group *g, const void *object)
{
  return &g->kinds[g->has_kind ? *(const int32_t *)((const char *)object + g->kind_offset) : 0];
}

int32_t group_find_kind(const Group *g, const char *name)
{
  for (size_t i = 0; i < g->kind_count; i++)
    if (!strcmp(g->kinds[i].name, name)) return (int32_t)i;
  return -1;
}

void *group_field(const Group *g, const void *object, const Field *f, bool is_common)
{
  return (char *)(size_t)object + (is_common ? g->common_offset : g->union_offset) + f->offset;
}

bool choice_name(const Field *f, int32_t i, char out[40])
{
  const char *p = f->unit;
  for (; i > 0; i--) {
    p = strchr(p, '|');
    if (!p) return false;
    p++;
  }
  const size_t n = strcspn(p, "|");
  if (n >= 40) return false;
  memcpy(out, p, n);
  out[n] = 0;
  return true;
}
