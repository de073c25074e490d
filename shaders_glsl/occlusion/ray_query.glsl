// What blocks a ray, asked of the device's own acceleration structures: any hit, the closest hit.
#ifndef OCCLUSION_RAY_QUERY_GLSL
#define OCCLUSION_RAY_QUERY_GLSL
#extension GL_EXT_ray_query : require

#include "shared/rays.glsl"
#ifdef MASKED
#include "shared/alpha_mask.glsl"
const uint RAY_FLAGS = gl_RayFlagsNoneEXT;
#else
const uint RAY_FLAGS = gl_RayFlagsOpaqueEXT;
#endif

layout(binding = 20) uniform accelerationStructureEXT scene_structure; // Its custom index is the instance.

// Runs a query to its end. Vulkan counts hits strictly between t_min and t_max, as we do. Only masked triangles are candidates: all others are taken by the device itself.
void ray_query_run(rayQueryEXT query, uint flags, vec3 origin, vec3 direction, float t_min, float t_max) {
  rayQueryInitializeEXT(query, scene_structure, flags, 0xffu, origin, t_min, direction, t_max);
  while (rayQueryProceedEXT(query)) {
#ifdef MASKED
    uint instance = rayQueryGetIntersectionInstanceCustomIndexEXT(query, false);
    uint triangle = rayQueryGetIntersectionPrimitiveIndexEXT(query, false);
    if (is_covered(instance, triangle, rayQueryGetIntersectionBarycentricsEXT(query, false))) {
      rayQueryConfirmIntersectionEXT(query);
    }
#endif
  }
}

// Whether anything blocks the ray between t_min and t_max.
bool occluded(vec3 origin, vec3 direction, float t_min, float t_max) {
  if (!is_ray(origin, direction, t_min, t_max)) {
    return false;
  }
  ++rays_traced;
  rayQueryEXT query;
  ray_query_run(query, RAY_FLAGS | gl_RayFlagsTerminateOnFirstHitEXT, origin, direction, t_min, t_max);
  return rayQueryGetIntersectionTypeEXT(query, true) == gl_RayQueryCommittedIntersectionTriangleEXT;
}

// What blocks the ray first between t_min and t_max. Where nothing does, hit.t is t_max and the rest is 0.
bool closest_hit(vec3 origin, vec3 direction, float t_min, float t_max, out RayHit hit) {
  hit = RayHit(t_max, 0u, 0u, vec2(0.0));
  if (!is_ray(origin, direction, t_min, t_max)) {
    return false;
  }
  ++rays_traced;
  rayQueryEXT query;
  ray_query_run(query, RAY_FLAGS, origin, direction, t_min, t_max);
  if (rayQueryGetIntersectionTypeEXT(query, true) != gl_RayQueryCommittedIntersectionTriangleEXT) {
    return false;
  }
  hit.t = rayQueryGetIntersectionTEXT(query, true);
  hit.instance = rayQueryGetIntersectionInstanceCustomIndexEXT(query, true);
  hit.triangle = rayQueryGetIntersectionPrimitiveIndexEXT(query, true);
  hit.barycentrics = rayQueryGetIntersectionBarycentricsEXT(query, true);
  return true;
}

#endif
