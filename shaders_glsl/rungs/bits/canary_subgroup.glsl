// Invocations in a subgroup, and subgroups in a group.
#extension GL_KHR_shader_subgroup_basic : require

uvec4 answer(uvec4 a, uvec4 b) {
  return uvec4(gl_SubgroupSize, gl_NumSubgroups, gl_SubgroupInvocationID, gl_SubgroupID);
}
