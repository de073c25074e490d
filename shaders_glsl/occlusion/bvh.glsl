// What blocks a ray, found by walking the hierarchy that the host builds: any hit, the closest hit.
#ifndef OCCLUSION_BVH_GLSL
#define OCCLUSION_BVH_GLSL

#include "shared/bvh_layout.glsl"
#include "shared/rays.glsl"
#ifdef MASKED
#include "shared/alpha_mask.glsl"
#endif

layout(std430, binding = 20) readonly buffer BvhNodes { BvhNode bvh_nodes[]; };
layout(std430, binding = 21) readonly buffer BvhTriangles { BvhTriangle bvh_triangles[]; };
layout(std430, binding = 22) readonly buffer BvhInstances { BvhInstance bvh_instances[]; };

// Entries of a traversal's stack: one for each node on a path suffices, and the host keeps to these depths.
const uint BVH_STACK = BVH_SCENE_LEVELS + BVH_MESH_LEVELS;

// Steps left to this invocation, for all its rays together. An ordinary ray takes tens to hundreds. A ray may take half
// of what is left, so that one lost in a crowd does not blind those after it. Lavapipe ends the loops of 8 invocations
// without a word when they have gone round 65,535 times between them. A ray that ends early for either reason is counted
// in rays_cut_short, and keeps what it has found; what it has not found does not block: too bright rather than black.
uint bvh_steps_left = 50000u;

// A ray in the space of one level, with what the tests of boxes and of triangles derive from its direction.
struct BvhRay {
  vec3 origin;
  vec3 inverse; // One over the direction; finite.
  uint axis; // The direction's longest component.
  vec3 shear; // With that axis last: direction.xy / direction.z, 1 / direction.z.
};

// The components of v in turn, with `axis` last.
vec3 bvh_turned(vec3 v, uint axis) {
  return axis == 2u ? v : axis == 1u ? v.zxy : v.yzx;
}

BvhRay bvh_ray_in(BvhInstance space, vec3 origin, vec3 direction) {
  vec4 point = vec4(origin, 1.0);
  vec4 x = space.local_from_scene[0];
  vec4 y = space.local_from_scene[1];
  vec4 z = space.local_from_scene[2];
  precise vec3 along = vec3(dot(x.xyz, direction), dot(y.xyz, direction), dot(z.xyz, direction));
  precise vec3 from = vec3(dot(x, point), dot(y, point), dot(z, point));
  vec3 size = abs(along);

  BvhRay ray;
  ray.origin = from;
  // With an inverse that is finite, a distance of 0 to a plane along the ray gives 0 and never NaN.
  vec3 least = mix(vec3(1e-30), vec3(-1e-30), lessThan(along, vec3(0.0)));
  ray.inverse = 1.0 / mix(along, least, lessThan(size, vec3(1e-30)));
  ray.axis = size.z >= max(size.x, size.y) ? 2u : size.y >= size.x ? 1u : 0u;
  vec3 turned = bvh_turned(along, ray.axis);
  ray.shear = vec3(turned.xy, 1.0) / turned.z;
  return ray;
}

// Where the ray is within a box, between t_min and t_max: x enters, y leaves. Kay and Kajiya 1986. The last factor is 1 + 33
// units of rounding: the differences, products and inverses on either side take 6 (Ize 2013, "Robust BVH ray
// traversal"), or 14 where a quotient is only good to Vulkan's 2.5 units in the last place. The rest, and the room the
// host leaves around every triangle, is for the roundings in the test of triangles: where it would say yes, so do boxes.
vec2 bvh_box_span(BvhRay ray, vec3 lower, vec3 upper, float t_min, float t_max) {
  vec3 to_lower = (lower - ray.origin) * ray.inverse;
  vec3 to_upper = (upper - ray.origin) * ray.inverse;
  vec3 enter = min(to_lower, to_upper);
  vec3 leave = max(to_lower, to_upper);
  float last = min(min(leave.x, leave.y), min(leave.z, t_max)) * 1.000002;
  return vec2(max(max(enter.x, enter.y), max(enter.z, t_min)), last);
}

// Tests one triangle: true where it is met between t_min and both hit.t, which then moves there, and t_max. The test of Woop, Benthin
// and Wald 2013, "Watertight ray/triangle intersection": the ray becomes the z axis, and three 2D edge functions tell
// its side of each edge. Two triangles that share an edge compute its function from the same two products, so they
// agree to the bit as long as nothing is contracted; rounding is monotone, so a sign is right or the value is 0, and 0
// counts for both. That closes the seam without the paper's recourse to doubles.
//
// Each function is off by up to 6 units of rounding of its products, which moves t by as much of the corner's depth as that
// is of the triangle's area: little, unless it is a needle, or huge. A hit no farther than that is none, since it may as well
// lie behind the origin, on the very triangle that the ray left. Nor is one that may lie behind the end, where a lamp is: there
// 2^-17 of the way is left out, since ends are moved off what lies there by more (offset_origin), and small errors are
// covered by that.
bool bvh_meets(BvhRay ray, BvhTriangle triangle, float t_min, float t_max, inout RayHit hit) {
  vec3 a = bvh_turned(triangle.a - ray.origin, ray.axis);
  vec3 b = bvh_turned(triangle.b - ray.origin, ray.axis);
  vec3 c = bvh_turned(triangle.c - ray.origin, ray.axis);
  precise vec2 a_sheared = a.xy - ray.shear.xy * a.z;
  precise vec2 b_sheared = b.xy - ray.shear.xy * b.z;
  precise vec2 c_sheared = c.xy - ray.shear.xy * c.z;
  precise float u = c_sheared.x * b_sheared.y - c_sheared.y * b_sheared.x;
  precise float v = a_sheared.x * c_sheared.y - a_sheared.y * c_sheared.x;
  precise float w = b_sheared.x * a_sheared.y - b_sheared.y * a_sheared.x;
  precise float doubled_area = u + v + w;
  // The quotient first: a depth, which is in the range of floats whatever the length of the direction makes of it.
  precise float t = (u * a.z + v * b.z + w * c.z) / doubled_area * ray.shear.z;
  vec3 sizes = vec3(
    dot(abs(c_sheared), abs(b_sheared.yx)),
    dot(abs(a_sheared), abs(c_sheared.yx)),
    dot(abs(b_sheared), abs(a_sheared.yx))
  );
  float t_error = 3.5e-7 * dot(sizes, abs(vec3(a.z, b.z, c.z))) / abs(doubled_area) * abs(ray.shear.z);
  bool inside = min(u, min(v, w)) >= 0.0 || max(u, max(v, w)) <= 0.0;
  // Seen edge-on, the area is 0 and so is every edge function.
  bool before_end = t < hit.t && t + max(t_error - 7.6e-6 * t_max, 0.0) < t_max;
  if (!inside || doubled_area == 0.0 || !(t > max(t_min, t_error) && before_end)) {
    return false;
  }
  hit.t = t;
  hit.triangle = triangle.index;
  hit.barycentrics = vec2(v, w) / doubled_area;
  return true;
}

// One walk for both questions. The outer loop goes from the scene into an instance and back; the inner one walks a
// level, and both levels with the same code, since a driver's compile time grows faster than its number of loops. Each
// step of it tests one waiting triangle and opens one node, as SIMD drivers pay for both branches in any case.
bool bvh_walk(vec3 origin, vec3 direction, float t_min, float t_max, bool any_will_do, out RayHit hit) {
  hit = RayHit(t_max, 0u, 0u, vec2(0.0));
  if (!is_ray(origin, direction, t_min, t_max)) {
    return false;
  }
  ++rays_traced;
  bool found = false;
  bool unfinished = false;
  uint steps_kept = bvh_steps_left / 2u; // For later rays.
  uint instance = 0u;
  uint stack[BVH_STACK];
  stack[0] = bvh_instances[0].root;
  uint height = 1u;

  while ((instance != 0u || height > 0u) && bvh_steps_left > steps_kept) {
    --bvh_steps_left;
    BvhInstance space = bvh_instances[instance];
    BvhRay ray = bvh_ray_in(space, origin, direction);
    uint floor_height = instance == 0u ? 0u : height; // What lies below belongs to the level above.
    uint cursor = space.root; // What to visit next.
    if (instance == 0u) {
      --height;
      cursor = stack[height];
    }
    uint next_instance = 0u;
    uint triangle = 0u; // From here to the end, the triangles of a leaf wait for their test.
    uint triangles_end = 0u;

    while (next_instance == 0u && (cursor != BVH_NOTHING || triangle < triangles_end) && bvh_steps_left > steps_kept) {
      --bvh_steps_left;
      if (triangle < triangles_end) {
        RayHit met = hit;
        bool blocks = bvh_meets(ray, bvh_triangles[triangle], t_min, t_max, met);
#ifdef MASKED
        // A loop, as some drivers execute branches always.
        for (bool asks = blocks; asks; asks = false) {
          blocks = is_covered(instance - 1u, met.triangle, met.barycentrics);
        }
#endif
        if (blocks) {
          found = true;
          hit = met;
          hit.instance = instance - 1u;
          if (any_will_do) {
            return true;
          }
        }
        ++triangle;
      }
      if (cursor < BVH_LEAF) {
        BvhNode node = bvh_nodes[cursor];
        vec2 span_0 = bvh_box_span(ray, node.lower_0, node.upper_0, t_min, hit.t);
        vec2 span_1 = bvh_box_span(ray, node.lower_1, node.upper_1, t_min, hit.t);
        bool meets_0 = span_0.x <= span_0.y;
        bool meets_1 = span_1.x <= span_1.y;
        bool first_is_near = meets_0 && !(meets_1 && span_1.x < span_0.x);
        if (meets_0 && meets_1) {
          stack[height] = first_is_near ? node.child_1 : node.child_0;
          ++height;
        }
        cursor = first_is_near ? node.child_0 : meets_1 ? node.child_1 : BVH_NOTHING;
      }
      // Nodes go on ahead of the waiting triangles; the next leaf does not.
      if (cursor >= BVH_LEAF && cursor != BVH_NOTHING && triangle == triangles_end) {
        uint first = cursor & ((1u << BVH_FIRST_BITS) - 1u);
        if (instance == 0u) {
          next_instance = first;
        } else {
          triangle = first;
          triangles_end = first + ((cursor >> BVH_FIRST_BITS) & 3u) + 1u;
        }
        cursor = BVH_NOTHING;
      }
      if (cursor == BVH_NOTHING && next_instance == 0u && height > floor_height) {
        --height;
        cursor = stack[height];
      }
    }
    // Not what the loop asked: a driver that ended it of its own accord may take it for answered.
    unfinished = unfinished || (next_instance == 0u && (cursor != BVH_NOTHING || triangle != triangles_end));
    instance = next_instance;
  }
  rays_cut_short += uint(unfinished || instance != 0u || height != 0u);
  return found;
}

// Whether anything blocks the ray between t_min and t_max.
bool occluded(vec3 origin, vec3 direction, float t_min, float t_max) {
  RayHit hit;
  return bvh_walk(origin, direction, t_min, t_max, true, hit);
}

// What blocks the ray first between t_min and t_max. Where nothing does, hit.t is t_max and the rest is 0.
bool closest_hit(vec3 origin, vec3 direction, float t_min, float t_max, out RayHit hit) {
  return bvh_walk(origin, direction, t_min, t_max, false, hit);
}

#endif
