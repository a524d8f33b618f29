// The variants of a step that a build has, as one list: features are taken out here and nowhere else.
#pragma once

#include "core/kernel_table.hpp"

namespace bristle::detail {
namespace {

/// `StepOf<T, axes, rule, mean, energy>::run` is the step of a variant.
template <class T, template <class, int, Rule, bool, bool> class StepOf, int axes>
constexpr void fill_axes(KernelSet<T>& set) {
  set.step[variant_index(axes, rule_keep, false, false)] = &StepOf<T, axes, rule_keep, false, false>::run;
#if !defined(BRISTLE_MINIMAL)
  set.step[variant_index(axes, rule_keep, true, false)] = &StepOf<T, axes, rule_keep, true, false>::run;
  set.step[variant_index(axes, rule_keep, false, true)] = &StepOf<T, axes, rule_keep, false, true>::run;
  set.step[variant_index(axes, rule_keep, true, true)] = &StepOf<T, axes, rule_keep, true, true>::run;
  set.step[variant_index(axes, rule_redraw, false, false)] = &StepOf<T, axes, rule_redraw, false, false>::run;
  set.step[variant_index(axes, rule_redraw, true, false)] = &StepOf<T, axes, rule_redraw, true, false>::run;
  set.step[variant_index(axes, rule_redraw, false, true)] = &StepOf<T, axes, rule_redraw, false, true>::run;
  set.step[variant_index(axes, rule_redraw, true, true)] = &StepOf<T, axes, rule_redraw, true, true>::run;
  set.step[variant_index(axes, rule_literal_keep, false, true)] =
      &StepOf<T, axes, rule_literal_keep, false, true>::run;
  set.step[variant_index(axes, rule_literal_redraw, false, true)] =
      &StepOf<T, axes, rule_literal_redraw, false, true>::run;
#endif
}

template <class T, template <class, int, Rule, bool, bool> class StepOf>
constexpr KernelSet<T> make_kernel_set(decltype(KernelSet<T>::rewrite) rewrite,
                                       decltype(KernelSet<T>::squares) squares) {
  KernelSet<T> set{};
  fill_axes<T, StepOf, 1>(set);
#if !defined(BRISTLE_MINIMAL)
  fill_axes<T, StepOf, 2>(set);
#endif
  set.rewrite = rewrite;
  set.squares = squares;
  return set;
}

}  // namespace
}  // namespace bristle::detail
