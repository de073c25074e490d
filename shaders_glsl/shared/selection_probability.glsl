// P-hat of Wang, Deng and Holzschuch 2020, Eq. 17, in closed form: with how many directions of light a flake is lit.
#ifndef SELECTION_PROBABILITY_GLSL
#define SELECTION_PROBABILITY_GLSL
#include "shared/constants.glsl"
#include "shared/error_function.glsl"

// V(o): the probability that a flake reflects o above the horizon, for Beckmann slopes and 0 < o.n <= 1, within 2e-4 for
// alpha from .001 to 1. The slopes that do fill a disk of radius 1/cos about one that is tan away in the plane of incidence;
// its near edge is cos / (1 + sin) from 0. Gauss-Legendre over the root of the distance from that edge, error functions
// across.
float reflected_above_horizon(float o_n, float alpha) {
  const float NODES[8] = float[](
    0.0950125098376374, 0.2816035507792589, 0.4580167776572274, 0.6178762444026438,
    0.7554044083550030, 0.8656312023878318, 0.9445750230732326, 0.9894009349916499
  );
  const float WEIGHTS[8] = float[](
    0.1894506104550685, 0.1826034150449236, 0.1691565193950025, 0.1495959888165767,
    0.1246289712555339, 0.0951585116824928, 0.0622535239386479, 0.0271524594117541
  );
  float sine = sqrt(max((1.0 - o_n) * (1.0 + o_n), 0.0));
  float edge = o_n / (1.0 + sine);
  float reach = 3.5 * alpha;
  if (edge >= reach) {
    return 1.0;
  }
  float from = 0.0;
  float to = sqrt(min(reach, 1.0 / edge) + edge);
  float diameter = 2.0 / o_n;
  float total = 0.0;
  for (int node = 0; node < 16; ++node) {
    float root = 0.5 * to * (1.0 + (node < 8 ? NODES[node] : -NODES[node - 8]));
    float slope = (root * root - edge) / alpha;
    float half_chord = root * sqrt(max(diameter - root * root, 0.0)) / alpha;
    total += WEIGHTS[node & 7] * root * exp(-slope * slope) * (1.0 - erfc_positive(half_chord));
  }
  return total * to / (alpha * sqrt(PI));
}

// 4 pi sin^2(gamma/2) V(o), a solid angle in steradians as the paper's P-hat is; never 0, so that it may divide.
float selection_probability(float o_n, float alpha, float sin2_half_gamma) {
  return 4.0 * PI * sin2_half_gamma * clamp(reflected_above_horizon(o_n, alpha), 1e-3, 1.0);
}

#endif
