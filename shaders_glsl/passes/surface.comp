// The surface seen through each pixel: position, normals, texture coordinates with their analytic footprint, and material.
//
// Derivatives come from the triangle and the camera's rays alone (Igehy 1999), never from neighbouring pixels, so that
// seams, silhouettes and far-off texture coordinates cannot disturb them.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#include "shared/frame.glsl"
#include "shared/materials.glsl"
#include "shared/directions.glsl"
#include "shared/texture_place.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 12) uniform utexture2D ids;
layout(std430, binding = 16) readonly buffer Normals { float normals[]; };
layout(std430, binding = 17) readonly buffer Tangents { vec4 tangents[]; };
layout(binding = 40, rgba32f) uniform writeonly image2D position; // xyz; w: first octahedral number of the triangle's normal.
layout(binding = 41, rgba32f) uniform writeonly image2D normal; // xyz; w: second octahedral number of the triangle's normal.
layout(binding = 42, rgba32f) uniform writeonly image2D uv; // Texture coordinates of the flakes; weight and roughness of the coat.
layout(binding = 43, rgba32f) uniform writeonly image2D footprint; // Their derivatives per sample, a pixel or a part of one: du/dx, dv/dx, du/dy, dv/dy.
layout(binding = 44, rgba32f) uniform writeonly image2D diffuse; // Diffuse reflectance; w: perceptual roughness.
layout(binding = 45, rgba32f) uniform writeonly image2D specular; // Reflectance at normal incidence; w: weight of the lobe.
layout(binding = 46, rgba32f) uniform writeonly image2D emission; // Emitted radiance; w: ambient occlusion.

vec3 interpolate(vec3 a, vec3 b, vec3 c, vec3 weights) {
  return weights.x * a + weights.y * b + weights.z * c;
}

vec3 vertex_normal(uint vertex) {
  return vec3(normals[3u * vertex], normals[3u * vertex + 1u], normals[3u * vertex + 2u]);
}

void main() {
  uvec2 pixel = gl_GlobalInvocationID.xy;
  if (outside_frame(pixel)) {
    return;
  }
  ivec2 at = ivec2(pixel);
  uvec2 id = texelFetch(ids, at, 0).xy;
  if (id.x == 0u) {
    return;
  }
  Instance instance = instances[id.x - 1u];
  Material material = materials[instance.material];
  uvec3 corners = triangle_vertices(instance, id.y);

  // The plane is met relative to the eye, where the numbers that matter are small. Edges are brought to about 1 first:
  // products of four of them would leave the range of a float for small triangles.
  vec3 corner = scene_point(instance, local_position(corners.x));
  vec3 side1 = scene_point(instance, local_position(corners.y)) - corner;
  vec3 side2 = scene_point(instance, local_position(corners.z)) - corner;
  vec3 longest = max(abs(side1), abs(side2));
  float unit = 1.0 / max(max(longest.x, max(longest.y, longest.z)), 1e-30);
  vec3 edge1 = unit * side1;
  vec3 edge2 = unit * side2;
  vec3 across = cross(edge1, edge2);
  float across2 = max(dot(across, across), 1e-30);
  vec3 a = corner - frame.eye.xyz;
  vec3 ray = camera_ray(pixel);
  // A triangle seen edge-on is hit nowhere in particular: its slope against the ray is kept from vanishing.
  float approach = dot(across, ray);
  float least = 1e-6 * sqrt(across2 * dot(ray, ray));
  approach = abs(approach) < least ? (approach < 0.0 ? -least : least) : approach;
  float t = dot(across, a) / approach;

  vec3 gradient1 = unit * cross(edge2, across) / across2;
  vec3 gradient2 = unit * cross(across, edge1) / across2;
  vec2 weights = vec2(dot(gradient1, t * ray - a), dot(gradient2, t * ray - a));
  // What the rasteriser lets through lies inside, but for rounding and for triangles seen edge-on.
  weights = clamp(weights, 0.0, 1.0);
  weights /= max(1.0, weights.x + weights.y);
  vec3 point = corner + weights.x * side1 + weights.y * side2;
  t = dot(point - frame.eye.xyz, ray) / dot(ray, ray);
  float per_sample = t * frame.span;
  vec3 point_dx = per_sample * (frame.ray_dx.xyz - ray * (dot(across, frame.ray_dx.xyz) / approach));
  vec3 point_dy = per_sample * (frame.ray_dy.xyz - ray * (dot(across, frame.ray_dy.xyz) / approach));
  vec3 barycentric = vec3(1.0 - weights.x - weights.y, weights);
  vec2 weights_dx = vec2(dot(gradient1, point_dx), dot(gradient2, point_dx));
  vec2 weights_dy = vec2(dot(gradient1, point_dy), dot(gradient2, point_dy));

  vec4 uv0 = vec4(0.0);
  vec4 uv1 = vec4(0.0);
  vec4 uv2 = vec4(0.0);
  if ((instance.flags & INSTANCE_HAS_UV) != 0u) {
    uv0 = uvs[corners.x];
    uv1 = uvs[corners.y];
    uv2 = uvs[corners.z];
  }
  vec4 uv_edge1 = uv1 - uv0;
  vec4 uv_edge2 = uv2 - uv0;
  vec4 uv_here = uv0 + weights.x * uv_edge1 + weights.y * uv_edge2;
  vec4 uv_dx = weights_dx.x * uv_edge1 + weights_dx.y * uv_edge2;
  vec4 uv_dy = weights_dy.x * uv_edge1 + weights_dy.y * uv_edge2;

  // A loop over the textures there are, not a branch for each there could be: drivers that run pixels as lanes of one
  // thread execute what is in a branch for all of them, but leave a loop when the last has.
  vec4 sampled[TEXTURE_SLOTS] = vec4[](
    vec4(1.0), vec4(1.0), vec4(0.5, 0.5, 1.0, 1.0), vec4(1.0), vec4(1.0), vec4(1.0), vec4(1.0), vec4(1.0), vec4(1.0)
  );
  for (uint index = 0u; index < (TEXTURES ? material.texture_count : 0u); ++index) {
    TextureUse use_of = material.textures[index];
    bool second = (use_of.slot_and_set & 1u) != 0u;
    sampled[use_of.slot_and_set >> 1] = sample_texture(
      use_of,
      second ? uv_here.zw : uv_here.xy,
      second ? uv_dx.zw : uv_dx.xy,
      second ? uv_dy.zw : uv_dy.xy
    );
  }

  vec3 toward_viewer = -normalize(ray);
  bool back = (dot(across, toward_viewer) < 0.0) != ((instance.flags & INSTANCE_MIRRORED) != 0u);
  vec3 geometric = normalize(dot(across, toward_viewer) < 0.0 ? -across : across);
  vec3 shading = scene_normal(
    instance,
    interpolate(vertex_normal(corners.x), vertex_normal(corners.y), vertex_normal(corners.z), barycentric)
  );
  float squared = dot(shading, shading);
  shading = squared > 1e-30 ? shading * inversesqrt(squared) : (back ? -geometric : geometric);
  if (NORMAL_MAPS && (material.flags & MATERIAL_NORMAL_MAP) != 0u && (instance.flags & INSTANCE_HAS_TANGENTS) != 0u) {
    vec4 t0 = tangents[corners.x];
    vec4 t1 = tangents[corners.y];
    vec4 t2 = tangents[corners.z];
    vec3 tangent = scene_vector(instance, interpolate(t0.xyz, t1.xyz, t2.xyz, barycentric));
    float handedness = t0.w * ((instance.flags & INSTANCE_MIRRORED) != 0u ? -1.0 : 1.0);
    vec3 bump = sampled[TEXTURE_NORMAL].xyz * 2.0 - 1.0;
    bump.xy *= material.emissive.w;
    shading = normalize(frame_along(shading, tangent, handedness) * bump);
  }
  shading = back ? -shading : shading;
  // A shading normal that turns away from the viewer is bent back to the silhouette: nothing can be seen from behind.
  float facing = dot(shading, toward_viewer);
  if (facing < 1e-3) {
    shading = normalize(shading + (1e-3 - facing) * toward_viewer);
  }

  vec4 base_color = material.base_color * sampled[TEXTURE_BASE_COLOR];
  if (VERTEX_COLORS && (instance.flags & INSTANCE_HAS_COLORS) != 0u) {
    vec4 tint = barycentric.x * colors[corners.x] + barycentric.y * colors[corners.y] + barycentric.z * colors[corners.z];
    base_color *= clamp(tint, 0.0, 1.0);
  }
  float metalness = material.surface.x * sampled[TEXTURE_METALLIC_ROUGHNESS].b;
  float roughness = material.surface.y * sampled[TEXTURE_METALLIC_ROUGHNESS].g;
  vec3 tinted = min(material.dielectric.rgb * sampled[TEXTURE_SPECULAR_COLOR].rgb, 1.0);
  vec3 f0 = mix(tinted, base_color.rgb, metalness);
  float weight = mix(material.dielectric.w * sampled[TEXTURE_SPECULAR].a, 1.0, metalness);
  vec3 scattered = base_color.rgb * (1.0 - metalness);
  vec3 emitted = material.emissive.rgb * sampled[TEXTURE_EMISSIVE].rgb;
  if ((material.flags & MATERIAL_UNLIT) != 0u) {
    emitted = base_color.rgb;
    scattered = vec3(0.0);
    weight = 0.0;
  }
  if (GLINTS && (material.flags & MATERIAL_GLINTS) != 0u) {
    f0 = material.glint_color.rgb;
    weight = 0.0;
  }
  float ambient = 1.0 + material.surface.z * (sampled[TEXTURE_OCCLUSION].r - 1.0);
  vec2 coat = material.coat.xy * vec2(sampled[TEXTURE_CLEARCOAT].r, sampled[TEXTURE_CLEARCOAT_ROUGHNESS].g);

  bool second_set = material.glint_uv_set == 1u;
  float uv_scale = material.glint_color.w;
  vec2 octahedral = octahedral_from(geometric);
  imageStore(position, at, vec4(point, octahedral.x));
  imageStore(normal, at, vec4(shading, octahedral.y));
  vec2 flakes_at = vec2(0.0);
  if (GLINTS) {
    flakes_at = texture_place(
      uv_scale * (second_set ? uv0.zw : uv0.xy),
      uv_scale * (second_set ? uv1.zw : uv1.xy),
      uv_scale * (second_set ? uv2.zw : uv2.xy),
      weights,
      (material.flags & MATERIAL_GLINT_REPEATS) != 0u
    );
    imageStore(footprint, at, uv_scale * vec4(second_set ? uv_dx.zw : uv_dx.xy, second_set ? uv_dy.zw : uv_dy.xy));
  }
  imageStore(uv, at, vec4(flakes_at, coat));
  imageStore(diffuse, at, vec4(scattered, clamp(roughness, 0.0, 1.0)));
  imageStore(specular, at, vec4(f0, weight));
  imageStore(emission, at, vec4(emitted, ambient));
}
