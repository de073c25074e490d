// How a bounding volume hierarchy lies in buffers: what scene::bvh writes and occlusion/bvh.glsl reads.
//
// A reference is what a child or a root holds. With BVH_LEAF clear it is the index of a node. With it set, the low
// BVH_FIRST_BITS bits are the first triangle of a leaf and the two bits above them its number of triangles less one; on
// the level of the scene they are an instance, alone.
#ifndef BVH_LAYOUT_GLSL
#define BVH_LAYOUT_GLSL

const uint BVH_LEAF = 0x80000000u; // Set in a reference to a leaf.
const uint BVH_FIRST_BITS = 29u; // Bits of a leaf's reference that hold its first triangle, or the instance.
const uint BVH_NOTHING = 0xffffffffu; // The reference to nothing: the root of an empty mesh or scene.
const uint BVH_SCENE_LEVELS = 24u; // Nodes on a path from the root of the scene to an instance, at most.
const uint BVH_MESH_LEVELS = 40u; // Nodes on a path from the root of a mesh to a leaf, at most.

// An inner node: the boxes of its two children and the references to them.
struct BvhNode {
  vec3 lower_0; // Least corner of the first child.
  uint child_0; // Reference to the first child.
  vec3 upper_0; // Greatest corner of the first child.
  uint child_1; // Reference to the second child.
  vec3 lower_1; // Least corner of the second child.
  vec3 upper_1; // Greatest corner of the second child.
};

// A triangle in the space of its mesh.
struct BvhTriangle {
  vec3 a; // First corner.
  uint index; // Which triangle of the mesh's own list it is.
  vec3 b; // Second corner.
  vec3 c; // Third corner.
};

// A placement of a mesh. The first one is the scene itself; the caller's instance i is number i + 1.
struct BvhInstance {
  vec4 local_from_scene[3]; // Rows of the affine transform.
  uint root; // Reference to the root of the mesh, or of the scene.
};

#endif
