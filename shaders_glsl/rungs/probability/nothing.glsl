// Computes nothing: what is left is reading the question and writing the answer.
float probability(vec3 i, vec3 o, float sin2_half_gamma, float alpha) {
  return 0.0;
}
