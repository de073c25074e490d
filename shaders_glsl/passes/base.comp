// Everything but the glints: the sky, emission, diffuse and smooth specular reflection, the clear coat.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/frame.glsl"
#include "shared/gbuffer.glsl"
#include "shared/lights.glsl"
#include "shared/microfacet.glsl"
#include "shared/smooth_lobe.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 30) uniform texture2D uv;
layout(binding = 31) uniform texture2D diffuse;
layout(binding = 32) uniform texture2D specular;
layout(binding = 33) uniform texture2D emission;
layout(binding = 34) uniform utexture2D shadow_mask;
layout(binding = 35) uniform texture2D irradiance;
layout(binding = 36) uniform texture2DArray prefiltered; // By GGX.
layout(binding = 37) uniform texture2D albedo; // Of GGX.
layout(binding = 40, rgba32f) uniform writeonly image2D radiance;

const float COAT_F0 = 0.04;

// What is mirrored at the surface does not reach the diffuse part below it; all channels lose what the greatest mirrors,
// as in glTF's mixing of a dielectric's two lobes.
float greatest(vec3 reflectance) {
  return max(reflectance.r, max(reflectance.g, reflectance.b));
}

struct Lobe {
  vec3 f0;
  float alpha;
};

vec3 lobe_under_light(Lobe lobe, vec3 n, vec3 i, vec3 o) {
  vec3 h = half_vector(i, o);
  float i_n = dot(i, n);
  float o_n = dot(o, n);
  if (h == vec3(0.0) || i_n <= 0.0 || o_n <= 0.0) {
    return vec3(0.0);
  }
  float d = ggx_d(h, n, lobe.alpha);
  float shadowing = ggx_g1_over_cosine(i_n, lobe.alpha) * ggx_g1_over_cosine(o_n, lobe.alpha);
  return schlick(lobe.f0, half_vector_cosine(i, o)) * (0.25 * d * shadowing);
}

vec3 lobe_under_environment(Lobe lobe, vec3 n, vec3 o, vec3 mirrored) {
  vec2 factors = lobe_albedo(albedo, clamp(dot(o, n), 0.0, 1.0), lobe.alpha);
  return prefiltered_radiance(prefiltered, mirrored, lobe.alpha) * (lobe.f0 * factors.x + factors.y);
}

void main() {
  uvec2 pixel = gl_GlobalInvocationID.xy;
  if (outside_frame(pixel)) {
    return;
  }
  ivec2 at = ivec2(pixel);
  Seen seen = seen_at(pixel);
  vec3 ray = normalize(camera_ray(pixel));
  bool lit_by_environment = has_environment();
  float scale = frame.environment.z;
  if (seen.instance == 0u) {
    vec3 sky = lit_by_environment ? scale * environment_radiance(environment_from_scene(ray), 0.0) : vec3(0.0);
    imageStore(radiance, at, vec4(sky, 0.0));
    return;
  }
  vec4 emission_occlusion = texelFetch(emission, at, 0);
  vec4 diffuse_roughness = texelFetch(diffuse, at, 0);
  vec4 f0_weight = texelFetch(specular, at, 0);
  vec2 coat_part = texelFetch(uv, at, 0).zw;

  vec3 n = seen.normal;
  vec3 o = -ray;
  float o_n = dot(o, n);
  Lobe lobe = Lobe(f0_weight.rgb, max(diffuse_roughness.w * diffuse_roughness.w, 2e-3));
  Lobe coat = Lobe(vec3(COAT_F0), max(coat_part.y * coat_part.y, 2e-3));
  float coat_weight = coat_part.x;

  vec3 below = vec3(0.0);
  vec3 above = vec3(0.0);
  if (lit_by_environment) {
    float ambient = emission_occlusion.w;
    vec3 up = environment_from_scene(n);
    vec3 mirrored = environment_from_scene(reflect(ray, n));
    vec3 reflected = vec3(0.0);
    if (SMOOTH_SPECULAR) {
      vec2 factors = lobe_albedo(albedo, clamp(o_n, 0.0, 1.0), lobe.alpha);
      reflected = f0_weight.w * (lobe.f0 * factors.x + factors.y);
    }
    if (DIFFUSE) {
      vec3 gathered = textureLod(sampler2D(irradiance, linear_wrap_u), equirect_from(up), 0.0).rgb;
      below += scale * ambient * (1.0 - greatest(reflected)) * diffuse_roughness.rgb * gathered;
    }
    if (SMOOTH_SPECULAR && f0_weight.w > 0.0) {
      below += scale * ambient * reflected * prefiltered_radiance(prefiltered, mirrored, lobe.alpha);
    }
    if (CLEAR_COAT && coat_weight > 0.0) {
      above += scale * ambient * lobe_under_environment(coat, n, o, mirrored);
    }
  }
  uint shadowed = SHADOWS && light_count() > 0u ? texelFetch(shadow_mask, at, 0).x : 0u;
  for (uint index = 0u; index < light_count(); ++index) {
    if ((shadowed >> index & 1u) == 0u) {
      Arrival arrival = arrival_at(lights[index], seen.position);
      float i_n = dot(arrival.direction, n);
      if (i_n > 0.0) {
        vec3 arriving = arrival.irradiance * i_n;
        float mirrors = 0.0;
        if (SMOOTH_SPECULAR) {
          mirrors = f0_weight.w * greatest(schlick(lobe.f0, half_vector_cosine(arrival.direction, o)));
        }
        if (DIFFUSE) {
          below += arriving * (1.0 - mirrors) * diffuse_roughness.rgb / PI;
        }
        if (SMOOTH_SPECULAR && f0_weight.w > 0.0) {
          below += arriving * f0_weight.w * lobe_under_light(lobe, n, arrival.direction, o);
        }
        if (CLEAR_COAT && coat_weight > 0.0) {
          above += arriving * lobe_under_light(coat, n, arrival.direction, o);
        }
      }
    }
  }
  vec3 color = emission_occlusion.rgb + below;
  if (CLEAR_COAT) {
    // Light passes the coat on its way in and out; the weight of what lies below follows glTF's layering.
    float coat_fresnel = coat_weight * schlick(vec3(COAT_F0), clamp(o_n, 0.0, 1.0)).x;
    color = emission_occlusion.rgb * (1.0 - coat_fresnel) + below * (1.0 - coat_fresnel) + coat_weight * above;
  }
  imageStore(radiance, at, vec4(color, 1.0));
}
