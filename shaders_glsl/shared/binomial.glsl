// Counts of successes, drawn by inversion: from one random word, the more the likelier success is.
#ifndef BINOMIAL_GLSL
#define BINOMIAL_GLSL
#include "shared/chances.glsl"
#include "shared/hash.glsl"

const float INVERTED_BELOW = 16.0; // Means below this are inverted step by step, others by a corrected normal.
const int MOST_INVERSION_STEPS = 64; // A mean of 16 stays below this but once in 1e18.
const float LEAST_MASS = 1e-10; // Beyond the mean, a count less probable than this is the last: no word is so rare.

// The standard normal number that is exceeded with probability v (Giles 2010, the single-precision fit).
float normal_exceeded(float v) {
  float w = -log(max(4.0 * v * (1.0 - v), 1e-30));
  bool middle = w < 5.0;
  float t = middle ? w - 2.5 : sqrt(w) - 3.0;
  float fit = middle ? 2.81022636e-8 : -2.00214257e-4;
  fit = fit * t + (middle ? 3.43273939e-7 : 1.00950558e-4);
  fit = fit * t + (middle ? -3.5233877e-6 : 1.34934322e-3);
  fit = fit * t + (middle ? -4.39150654e-6 : -3.67342844e-3);
  fit = fit * t + (middle ? 2.1858087e-4 : 5.73950773e-3);
  fit = fit * t + (middle ? -1.25372503e-3 : -7.6224613e-3);
  fit = fit * t + (middle ? -4.17768164e-3 : 9.43887047e-3);
  fit = fit * t + (middle ? 0.246640727 : 1.00167406);
  fit = fit * t + (middle ? 1.50140941 : 2.83297682);
  return 1.41421356 * fit * (1.0 - 2.0 * v);
}

// The number of successes that is exceeded with probability v, where that is three or more: the quantile by Cornish and
// Fisher (1938) to the second order, its variance less the 1/12 that rounding adds.
float matched_normal(float n, float q, float mean, float v) {
  float z = normal_exceeded(clamp(v, 1e-9, 0.99999994));
  float variance = mean * (1.0 - q);
  float skewness = (1.0 - 2.0 * q) * inversesqrt(variance);
  float kurtosis = (1.0 - 6.0 * q * (1.0 - q)) / variance;
  float z2 = z * z;
  float quantile = z + (z2 - 1.0) * skewness / 6.0 + (z2 - 3.0) * z * kurtosis / 24.0
    - (2.0 * z2 - 5.0) * z * skewness * skewness / 36.0;
  return clamp(floor(mean + 0.5 + sqrt(max(variance - 1.0 / 12.0, 0.0)) * quantile), 0.0, n);
}

// Loop iterations that `binomial` takes on average.
float binomial_steps(float n, float p) {
  float mean = n * min(p, max(1.0 - p, 0.0));
  return mean < INVERTED_BELOW ? mean : 0.0;
}

// Binomial(n, p) for whole n. Grows with p for the same word; small words are many successes, so that rare ones keep
// their probability. Beyond a mean of 16 a matched normal number.
float binomial(float n, float p, uint word) {
  bool mirrored = p > 0.5;
  float q = mirrored ? max(1.0 - p, 0.0) : p;
  float v = rare_unit_from(mirrored ? ~word : word);
  float mean = n * q;
  float count = 0.0;
  float log_none = n * log_one_minus(q);
  if (mean < INVERTED_BELOW) {
    // The probabilities of `count` successes and of more. What is left of the latter by subtraction is rounding where it is
    // below 1e-7: the former, a product, then ends the loop.
    float exactly = exp(log_none);
    float tail = one_minus_exp(log_none);
    float odds = q / (1.0 - q);
    for (int step = 0; step < MOST_INVERSION_STEPS && v < tail && count < n; ++step) {
      if (count > mean && exactly < LEAST_MASS) {
        break;
      }
      count += 1.0;
      exactly *= odds * (n - count + 1.0) / count;
      tail -= exactly;
    }
  } else {
    count = matched_normal(n, q, mean, v);
  }
  return mirrored ? n - count : count;
}

// Binomial(n, p) for whole n without a loop: exact thresholds for the first three counts, above them a matched normal number.
// The same orientation of the word as above.
float binomial_without_loop(float n, float p, uint word) {
  bool mirrored = p > 0.5;
  float q = mirrored ? max(1.0 - p, 0.0) : p;
  float v = rare_unit_from(mirrored ? ~word : word);
  float mean = n * q;
  float log_none = n * log_one_minus(q);
  float odds = q / (1.0 - q);
  float none = exp(log_none);
  float one = none * odds * n;
  float two = one * odds * 0.5 * max(n - 1.0, 0.0);
  float any = one_minus_exp(log_none);
  float few = v < any ? (v < any - one ? 2.0 : 1.0) : 0.0;
  float count = v < any - one - two ? max(matched_normal(n, q, mean, v), 3.0) : few;
  count = min(count, n);
  return mirrored ? n - count : count;
}

#endif
