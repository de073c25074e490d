// The nearest of a list of triangles along each ray, one after the other by the test of Moeller and Trumbore 1997, whose three
// conditions do not agree between neighbours: what a renderer's own search is held against.
#version 460
#extension GL_GOOGLE_include_directive : require

layout(local_size_x = 64) in;

struct ListedRay {
  vec3 origin;
  float t_max;
  vec3 direction;
  uint reserved;
};

struct ListedTriangle {
  vec4 corners[3]; // The fourth number of each is not used.
};

struct ListedHit {
  float t;
  uint triangle; // Counted from 1; 0 where none is met.
};

layout(std430, binding = 30) readonly buffer ListedRays { ListedRay rays[]; };
layout(std430, binding = 31) readonly buffer ListedTriangles { ListedTriangle triangles[]; };
layout(std430, binding = 40) writeonly buffer ListedHits { ListedHit hits[]; };
layout(push_constant) uniform Params {
  uint count; // Rays.
  uint triangle_count;
};

void main() {
  uint index = gl_GlobalInvocationID.x;
  if (index >= count) {
    return;
  }
  ListedRay ray = rays[index];
  ListedHit hit = ListedHit(ray.t_max, 0u);
  for (uint triangle = 0u; triangle < triangle_count; ++triangle) {
    vec3 corner = triangles[triangle].corners[0].xyz;
    vec3 side_1 = triangles[triangle].corners[1].xyz - corner;
    vec3 side_2 = triangles[triangle].corners[2].xyz - corner;
    vec3 across = cross(ray.direction, side_2);
    float over = 1.0 / dot(side_1, across);
    vec3 from = ray.origin - corner;
    float u = dot(from, across) * over;
    vec3 turned = cross(from, side_1);
    float v = dot(ray.direction, turned) * over;
    float t = dot(side_2, turned) * over;
    if (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > 0.0 && t < hit.t) {
      hit = ListedHit(t, triangle + 1u);
    }
  }
  hits[index] = hit;
}
