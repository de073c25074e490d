// How nodes of the hierarchy of Jakob et al. 2014 lie to cones: by the roots of the cone's conic on the edges of a node, as
// an implementation of the paper has it, and by chords, as `jakob` does.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/jakob_overlap.glsl"

layout(local_size_x = 64) in;

// A spherical triangle, the cone about it, and the cone that is asked for.
struct NodeQuestion {
  vec3 v0; // First corner.
  float chord_radius; // From the axis to the rim of the triangle's cone.
  vec3 v1; // Second corner.
  float sin_half; // Sine of half the half-angle of the cone that is asked for.
  vec3 v2; // Third corner.
  float cos_half; // Its cosine.
  vec3 axis; // Of the triangle's cone.
  float cos_gamma; // Cosine of the whole half-angle.
  vec4 i; // Unit; the fourth number is not read.
  vec4 o; // Unit; likewise.
};

layout(std430, binding = 30) readonly buffer NodeQuestions { NodeQuestion questions[]; };
layout(std430, binding = 40) writeonly buffer NodeSides { uvec2 sides[]; }; // By roots, by chords: JAKOB_*.
layout(push_constant) uniform Params {
  uint count; // Questions.
};

// Whether m' C m has a root between two corners.
bool edge_crosses(mat3 conic, vec3 from, vec3 to) {
  vec3 along = to - from;
  float a = dot(along, conic * along);
  float b = 2.0 * dot(along, conic * from);
  float c = dot(from, conic * from);
  float root = sqrt(b * b - 4.0 * a * c);
  vec2 crossing = vec2(-b - root, -b + root) / (2.0 * a);
  return (crossing.x >= 0.0 && crossing.x <= 1.0) || (crossing.y >= 0.0 && crossing.y <= 1.0);
}

uint side_by_roots(NodeQuestion question) {
  vec3 i = question.i.xyz;
  vec3 o = question.o.xyz;
  float k = dot(i, o) + question.cos_gamma;
  mat3 conic = (k * mat3(1.0) - outerProduct(i, o) - outerProduct(o, i)) / (1.0 - question.cos_gamma);
  if (
    edge_crosses(conic, question.v0, question.v1) || edge_crosses(conic, question.v1, question.v2)
    || edge_crosses(conic, question.v2, question.v0)
  ) {
    return JAKOB_PARTLY;
  }
  return dot(question.v0, conic * question.v0) <= 0.0 && dot(i, question.v0) > 0.0 ? JAKOB_INSIDE : JAKOB_OUTSIDE;
}

void main() {
  uint index = gl_GlobalInvocationID.x;
  if (index >= count) {
    return;
  }
  NodeQuestion question = questions[index];
  JakobTriangle triangle = JakobTriangle(
    question.v0, 2u, question.v1, 0u, question.v2, 0.0, question.axis, question.chord_radius, uvec3(0u), 0u
  );
  JakobCone cone = JakobCone(question.i.xyz, question.o.xyz, question.sin_half, question.cos_half);
  float share;
  sides[index] = uvec2(side_by_roots(question), jakob_side_of_cone(triangle, cone, share));
}
