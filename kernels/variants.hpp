// The variants of a step that a build has, as one list: features are taken out here and nowhere else.
#pragma once

#include "core/kernel_table.hpp"
#include "renew.hpp"

namespace bristle::detail {
namespace {

/// `StepOf<T, axes, rule, mean, energy, residual>::run` is the step of a variant.
template <class T, template <class, int, Rule, bool, bool, bool> class StepOf, int axes, Rule rule,
          bool residual>
constexpr void fill_outputs(KernelSet<T>& set) {
  const auto fill = [&set](auto* step, bool mean, bool energy) {
    set.step[variant_index(axes, rule, mean, energy, residual)] = step;
  };
  fill(&StepOf<T, axes, rule, false, false, residual>::run, false, false);
#if !defined(BRISTLE_MINIMAL)
  fill(&StepOf<T, axes, rule, true, false, residual>::run, true, false);
  fill(&StepOf<T, axes, rule, false, true, residual>::run, false, true);
  fill(&StepOf<T, axes, rule, true, true, residual>::run, true, true);
#endif
}

template <class T, template <class, int, Rule, bool, bool, bool> class StepOf, int axes>
constexpr void fill_axes(KernelSet<T>& set) {
  fill_outputs<T, StepOf, axes, rule_keep, false>(set);
#if !defined(BRISTLE_MINIMAL)
  fill_outputs<T, StepOf, axes, rule_redraw, false>(set);
  fill_outputs<T, StepOf, axes, rule_keep, true>(set);
  fill_outputs<T, StepOf, axes, rule_redraw, true>(set);
  set.step[variant_index(axes, rule_literal_keep, false, true, false)] =
      &StepOf<T, axes, rule_literal_keep, false, true, false>::run;
  set.step[variant_index(axes, rule_literal_redraw, false, true, false)] =
      &StepOf<T, axes, rule_literal_redraw, false, true, false>::run;
#endif
}

template <class T, template <class, int, bool> class ForeseeOf>
constexpr void fill_foresee(KernelSet<T>& set) {
  set.foresee[0][0] = &ForeseeOf<T, 1, false>::run;
  set.foresee[0][1] = &ForeseeOf<T, 1, true>::run;
  set.foresee[1][0] = &ForeseeOf<T, 2, false>::run;
  set.foresee[1][1] = &ForeseeOf<T, 2, true>::run;
}

template <class T, template <class, int, Rule, bool, bool, bool> class StepOf,
          template <class, int, bool> class ForeseeOf, class Lengths>
constexpr KernelSet<T> make_kernel_set(decltype(KernelSet<T>::rewrite) rewrite,
                                       decltype(KernelSet<T>::squares) squares) {
  KernelSet<T> set{};
  fill_axes<T, StepOf, 1>(set);
#if !defined(BRISTLE_MINIMAL)
  fill_axes<T, StepOf, 2>(set);
  fill_foresee<T, ForeseeOf>(set);
  set.renew[0][0] = &renew_bristles<T, 1, false, Lengths>;
  set.renew[0][1] = &renew_bristles<T, 1, true, Lengths>;
  set.renew[1][0] = &renew_bristles<T, 2, false, Lengths>;
  set.renew[1][1] = &renew_bristles<T, 2, true, Lengths>;
#endif
  set.rewrite = rewrite;
  set.squares = squares;
  return set;
}

}  // namespace
}  // namespace bristle::detail
