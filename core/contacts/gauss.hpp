// Points and weights of Gauss-Legendre integration, computed without the C library's functions, whose bits
// differ from machine to machine.
#pragma once

#include <vector>

#include "core/materials/turn.hpp"

namespace bristle::detail {

struct Node {
  double at = 0.0, weight = 0.0;
};
using Nodes = std::vector<Node>;

/// Returns the n points of Gauss-Legendre integration from -1 to 1 and their weights, which have the sum 1.
inline Nodes legendre_nodes(int n) {
  Nodes nodes;
  for (int i = 0; i < n; ++i) {
    double x = turn_by(pi * (i + 0.75) / (n + 0.5)).cosine;
    double slope = 1.0;
    for (int pass = 0; pass < 8; ++pass) {  // Newton's method, quadratically convergent from the first pass
      double before = 1.0, value = x;
      for (int k = 2; k <= n; ++k) {
        const double next = ((2 * k - 1) * x * value - (k - 1) * before) / k;
        before = value;
        value = next;
      }
      slope = n * (x * value - before) / (x * x - 1.0);
      x -= value / slope;
    }
    nodes.push_back({x, 1.0 / ((1.0 - x * x) * slope * slope)});
  }
  return nodes;
}

}  // namespace bristle::detail
