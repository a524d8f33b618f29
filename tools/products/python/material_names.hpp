// Python names of the snap rules and of the dampers' decay.
#pragma once

#include "tools/products/python/keyword_class.hpp"

namespace bristle_python {

template <class E, unsigned count>
Names<E> in_order(const char* const (&names)[count]) {
  return in_order<E>(names, count);
}
inline const auto rule_names = in_order<bristle::SnapRule>(bristle::snap_rule_names);
inline const auto decay_names = in_order<bristle::DamperDecay>(bristle::damper_decay_names);

}  // namespace bristle_python
