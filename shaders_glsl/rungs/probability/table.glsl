// A look-up in the table of Wang, Deng and Holzschuch 2020, made for one roughness and one cone.
#include "shared/accumulated_dpf.glsl"

float probability(vec3 i, vec3 o, float sin2_half_gamma, float alpha) {
  return accumulated_probability(i, o);
}
