// J. Shopf: "Gettin' Procedural", AMD: snow's sparkle as a grid bent by noise and moved by the view, where the lobe is lit.
//
// What is known of it: f = fract(0.7 x + 9 noise(0.04 x) + 0.1 v), glitter = clamp(1 - 7 sum f (1 - f)), times a broad
// specular lobe; x in object space, v the vector to the eye. What is not is decided in the method's Rust file.
#include "shared/cells.glsl"
#include "shared/hash.glsl"
#include "shared/lobe_light.glsl"
#include "shared/texture_density.glsl"

layout(push_constant) uniform Params {
  uint material; // Index of the material.
  uint seed; // Of the noise.
  float alpha; // Roughness of the base lobe.
  float broad_alpha; // Roughness of the lobe that glitters.
  float lit_flakes; // Lit in a square of texture space, where the lobe is brightest.
  float glitter_share; // Of the lobe's light that glitters.
  float noise_cells; // Amplitude of the noise in cells of the grid.
  float twinkle; // Cells that the grid moves by when the eye moves by one.
  uint repaired; // 1 fades the grid out where a float does not resolve it.
};

const float SHARPNESS = 7.0; // Of the sparkles about the grid's corners.
const float MEAN_GLITTER = 0.0011793331; // Mean over a cell of clamp(1 - 7 sum f (1 - f)), by quadrature.
const float CORNERS_A_FACE = 0.29; // Corners of the grid that shine through a cell's face: their mean width.
const float NOISE_FREQUENCY = 0.0571428571; // Of the noise, in periods a cell: 0.04 / 0.7.
const float FADED_FROM = 65536.0; // Cells from the origin from which the repaired grid fades,
const float FADED_TO = 262144.0; // and where it is gone: 32 floats a cell are left there.

// What the glittering lobe is multiplied by; 1 on average.
float glitter;

// Noise in 0..1: random values at whole places, linear between them, as a texture of random texels is.
float value_noise(vec3 place) {
  vec3 base = floor(place);
  vec3 part = place - base;
  ivec3 index = cell_of(place);
  float sum = 0.0;
  for (int corner = 0; corner < 8; ++corner) {
    ivec3 step = ivec3(corner & 1, corner >> 1 & 1, corner >> 2);
    vec3 weights = mix(1.0 - part, part, vec3(step));
    uvec3 at = uvec3(index + step);
    sum += weights.x * weights.y * weights.z * unit_from(hash(at.x, at.y, hash(at.z, seed)));
  }
  return sum;
}

float glitter_at(GlintSurface surface) {
  vec3 to_eye = frame.eye.xyz - surface.position;
  float lit = lit_flakes * texture_density(surface);
  // As many corners in a square metre as lit flakes, to the nearest power of 4: where the texture is stretched, the grid
  // must not be stretched smoothly with it, or it would be crushed.
  float octave = floor(0.5 * log2(max(lit / CORNERS_A_FACE, 1e-30)) + 0.5);
  float cells_a_metre = ldexp(1.0, int(clamp(octave, -40.0, 40.0)));
  vec3 place = cells_a_metre * surface.position;
  vec3 bent = place + noise_cells * value_noise(NOISE_FREQUENCY * place) + twinkle * cells_a_metre * to_eye;
  vec3 part = fract(bent);
  vec3 from_corner = part * (1.0 - part);
  float shine = clamp(1.0 - SHARPNESS * (from_corner.x + from_corner.y + from_corner.z), 0.0, 1.0) / MEAN_GLITTER;
  if (repaired == 1u) {
    vec3 far = max(abs(place), abs(twinkle * cells_a_metre * to_eye));
    shine = mix(shine, 1.0, smoothstep(FADED_FROM, FADED_TO, max(far.x, max(far.y, far.z))));
  }
  return shine;
}

float glint_density(GlintSurface surface, vec3 i, vec3 h) {
  float base = beckmann_d(h, surface.normal, alpha);
  float broad = beckmann_d(h, surface.normal, broad_alpha);
  return mix(base, glitter * broad, glitter_share);
}

vec3 glint_radiance(GlintSurface surface) {
  glitter = glitter_at(surface);
  return smooth_environment(surface, alpha) + lobe_under_lights(surface, alpha);
}
