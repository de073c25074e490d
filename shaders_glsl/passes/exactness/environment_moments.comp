// What the flakes of each pixel show of the environment: a few flakes each by what it mirrors itself, more by two moments, and
// small bright lights that were taken out of the environment by the number of flakes that are lit.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/footprint_area.glsl"
#include "shared/glint_surface.glsl"
#include "shared/lit_probability.glsl"
#include "shared/two_moments.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 40, rgba32f) uniform writeonly image2D glints;
layout(binding = 50) uniform texture2DArray first_moment;
layout(binding = 51) uniform texture2DArray second_moment;
layout(binding = 52) uniform texture2D environment_cone; // The environment by the flakes' cones.
layout(std430, binding = 53) readonly buffer ExtractedLights { vec4 extracted[]; }; // Directions, and irradiances, in turn.
layout(push_constant) uniform Params {
  float alpha; // Roughness.
  float sin2_half_gamma; // Of the cone's half-angle.
  float flakes; // In a square of texture space: N.
  uint seed; // Of the flakes.
  uint rings; // Of normals that the moments are summed over; 0 is one normal.
  uint sectors; // Normals of a ring.
  uint each_below; // So many flakes, and fewer, are looked at one by one.
  uint light_count; // Lights that were taken out.
} params;

// What the lit flakes among `count` add: each light by the number that its own law gives.
vec3 extracted_radiance(vec3 n, vec3 o, mat3 from_local, vec3 f0, float count, float expected, uint word) {
  float solid_angle = 4.0 * PI * params.sin2_half_gamma;
  vec3 radiance = vec3(0.0);
  for (uint index = 0u; index < params.light_count; ++index) {
    vec3 i = scene_from_environment(extracted[2u * index].xyz);
    vec3 sum = i + o;
    float i_n = dot(i, n);
    float h_n = dot(sum, n) * inversesqrt(max(dot(sum, sum), 1e-12));
    if (i_n > 0.0 && h_n > 0.0) {
      float p = lit_probability(i * from_local, o * from_local, params.sin2_half_gamma, params.alpha);
      float lit = binomial(count, min(p, 1.0), hash(word, index));
      float shadowing =
        beckmann_g1_over_cosine(i_n, params.alpha) * beckmann_g1_over_cosine(dot(o, n), params.alpha) * i_n;
      float i_h = half_vector_cosine(i, o);
      vec3 each = extracted[2u * index + 1u].rgb * schlick(f0, i_h) * (i_h * shadowing / (h_n * solid_angle));
      radiance += lit / expected * each;
    }
  }
  return frame.environment.z * radiance;
}

void main() {
  uvec2 pixel = gl_GlobalInvocationID.xy;
  if (outside_frame(pixel)) {
    return;
  }
  Seen seen = seen_at(pixel);
  if (seen.instance == 0u) {
    return;
  }
  GlintSurface surface = glint_surface(pixel, seen);
  mat3 from_local = frame_about(surface.normal);
  vec3 o = surface.o;
  float area = footprint_area(surface.uv_dx, surface.uv_dy);
  float expected = area * params.flakes;
  uint word = hash(pixel.x, pixel.y, params.seed);
  float count = binomial(params.flakes, min(area, 1.0), word);

  vec3 radiance = vec3(0.0);
  bool one_by_one = count <= float(params.each_below);
  uint each = one_by_one ? uint(count) : 0u;
  for (uint flake = 0u; flake < each; ++flake) {
    uint first = hash(word, 2u * flake + 1u);
    vec2 u = vec2(unit_from(first), unit_from(mixed(first)));
    vec3 facet = from_local * sample_beckmann(u, params.alpha);
    vec3 mirrored;
    vec3 share = flake_share(facet, surface.normal, o, surface.f0, params.alpha, mirrored);
    vec2 uv = equirect_from(environment_from_scene(mirrored));
    radiance += frame.environment.z / expected * share
      * textureLod(sampler2D(environment_cone, linear_wrap_u), uv, 0.0).rgb;
  }
  // A loop that runs once or never, as some drivers execute branches always.
  for (bool once = !one_by_one; once; once = false) {
    FlakeMoments moments = flake_moments(
      first_moment, second_moment, from_local, o, surface.f0, params.alpha, params.rings, params.sectors
    );
    radiance += drawn_radiance(moments, count, expected, uvec2(mixed(word + 1u), mixed(word + 2u)));
  }
  radiance += extracted_radiance(surface.normal, o, from_local, surface.f0, count, expected, word);
  imageStore(glints, ivec2(pixel), vec4(radiance, 1.0));
}
