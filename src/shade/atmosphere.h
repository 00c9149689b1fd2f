// Atmosphere: the light of the clear sky and of the sun, from the air's own properties. Baked once into a panorama whose
// rows crowd at the horizon, where the sky changes fastest; what is left of the sun's light comes beside it. Cold.
//
// Single scattering is integrated along each view ray (Nishita et al. 1993; Bruneton and Neyret 2008); all further
// orders are taken as even in direction and summed as a geometric series (Hillaire 2020, section 5.5). Eight bands of
// wavelengths from 400 to 720 nm, turned to linear Rec.709 by the CIE 1931 observer.
//
// Not in it: clouds, the moon, stars, refraction, polarisation, and darkening towards the sun's rim.

#ifndef RAYFOLD_SHADE_ATMOSPHERE_H
#define RAYFOLD_SHADE_ATMOSPHERE_H

#include "base/jobs.h"
#include "base/vec.h"

enum { ATMOSPHERE_WIDE = 256, ATMOSPHERE_HIGH = 128 }; // of the panorama

typedef struct Atmosphere {
  float elevation;        // radians, of the sun's centre above the horizontal
  float altitude;         // metres, of the eye above the ground
  float air, dust, ozone; // densities, 1 is a clear day
  Vec3 albedo;            // of the ground below
  float sun_radius;       // radians
} Atmosphere;

typedef struct AtmosphereLight {
  float horizon; // radians from the zenith: where the ground begins
  Vec3 sun;      // irradiance on a surface that faces it, at the eye
} AtmosphereLight;

// The luminance of the sun's irradiance above the air, so that a high sun gives about what the light "sun" does.
#define ATMOSPHERE_SUN 4.0f

// Fills pixels, ATMOSPHERE_WIDE x ATMOSPHERE_HIGH rgb, as a SkyMap with this horizon reads them, the sun in the middle.
// False: memory is out, or it was cancelled.
bool atmosphere_bake(const Atmosphere *a, float *pixels, AtmosphereLight *out, Jobs *jobs, const Cancel *cancel,
                     Err *err);

#endif
