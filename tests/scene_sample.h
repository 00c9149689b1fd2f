// A scene with one of everything, for the tests of the scene language, and a folder of its own for their files.

#ifndef RAYFOLD_TESTS_SCENE_SAMPLE_H
#define RAYFOLD_TESTS_SCENE_SAMPLE_H

#include "base/file.h"
#include "scene/scene.h"

#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

static const char sample_scene[] =
    "{\n"
    "  \"rayfold\": 1,\n"
    "  \"render\": { \"spp\": 16, \"size\": [320, 200], \"filter\": \"box\" },\n"
    "  \"develop\": { \"exposure\": -1.5, \"tone_curve\": \"agx\" },\n"
    "  \"camera\": { \"position\": [0, 1, 5], \"target\": [0, 0.5, 0], \"fov\": 35.5 },\n"
    "  \"cameras\": { \"top\": { \"kind\": \"orthographic\", \"position\": [0, 9, 0], \"target\": [0, 0, "
    "0],\n"
    "                       \"up\": [0, 0, -1], \"height\": 3 } },\n"
    "  \"sky\": { \"kind\": \"gradient\", \"zenith\": \"#3a6ea5\", \"gain\": 0.75 },\n"
    "  \"objects\": [\n"
    "    { \"name\": \"ball\", \"shape\": { \"kind\": \"sphere\", \"radius\": 0.5 }, \"material\": "
    "\"gold\",\n"
    "      \"translate\": [0, 0.5, 0] },\n"
    "    { \"name\": \"my box\", \"shape\": { \"kind\": \"box\", \"size\": 2 }, \"material\": \"my mat\",\n"
    "      \"matrix\": [1,0,0,0, 0,2,0,0, 0,0,1,0, 3,4,5,1] },\n"
    "    { \"shape\": { \"kind\": \"mesh\", \"positions\": [[0,0,0],[1,0,0],[0,1,0]], \"triangles\": "
    "[0,1,2],\n"
    "      \"normals\": [0,0,1, 0,0,3, 0,1,1], \"texcoords\": [[0,0],[1,0],[0,1]] }, \"casts_shadow\": false "
    "}\n"
    "  ],\n"
    "  \"textures\": { \"tiles\": { \"kind\": \"checker\", \"color_a\": 0.9, \"scale\": [4, 4] },\n"
    "                \"w\\u00f6od\": { \"kind\": \"image\", \"file\": \"w\\u00f6od.png\", \"wrap_u\": "
    "\"mirror\" } },\n"
    "  \"materials\": {\n"
    "    \"gold\": { \"kind\": \"pbr\", \"base_color\": [1, 0.77, 0.34], \"metallic\": 1, \"roughness\": "
    "0.2,\n"
    "              \"roughness_texture\": \"tiles\" },\n"
    "    \"my mat\": { \"kind\": \"lambert\", \"albedo\": \"#f80\", \"albedo_texture\": \"w\\u00f6od\" },\n"
    "    \"a.b\\\"c\": { \"kind\": \"glass\", \"ior\": 1.33 }\n"
    "  },\n"
    "  \"media\": { \"fog\": { \"kind\": \"homogeneous\", \"density\": 0.5, \"anisotropy\": 0.3 } },\n"
    "  \"lights\": [ { \"name\": \"lamp\", \"kind\": \"rect\", \"size\": [0.5, 0.25], \"radiance\": 20 },\n"
    "              { \"kind\": \"sun\", \"direction\": [1, 2, 1] } ]\n"
    "}\n";

static char sample_folder[64];

// The path of a file in the test's folder, which is made at the first call and valid until the fourth call after.
static const char *sample_path(const char *name)
{
  static char paths[4][256];
  static int next;
  if (!sample_folder[0]) {
    snprintf(sample_folder, sizeof sample_folder, "/tmp/rayfold_test.XXXXXX");
    if (!mkdtemp(sample_folder)) abort();
  }
  char *path = paths[next++ % 4];
  snprintf(path, sizeof paths[0], "%s/%s", sample_folder, name);
  return path;
}

static const char *sample_write(const char *name, const void *data, size_t size)
{
  const char *path = sample_path(name);
  FILE *f = fopen(path, "wb");
  if (!f || fwrite(data, 1, size, f) != size || fclose(f)) abort();
  return path;
}

// Loads a text as a scene file; NULL and the message on failure.
static Scene *sample_load_n(const char *text, size_t size, Err *err)
{
  *err = (Err){0};
  return scene_load(sample_write("sample.json", text, size), NULL, err);
}

static Scene *sample_load(const char *text, Err *err)
{
  return sample_load_n(text, strlen(text), err);
}

static void sample_remove(void)
{
  char command[100];
  snprintf(command, sizeof command, "rm -rf %s", sample_folder);
  if (sample_folder[0] && system(command)) abort();
}

#endif
