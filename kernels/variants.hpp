// The variants of a step that a build has, as one list: features are taken out here and nowhere else.
#pragma once

#include "core/kernel_table.hpp"
#include "renew.hpp"

namespace bristle::detail {
namespace {

/// `StepOf<T, axes, rule, mean, energy, residual, ages>::run` is the step of a variant.
template <class T, template <class, int, Rule, bool, bool, bool, bool> class StepOf, int axes, Rule rule,
          bool residual>
constexpr void fill_outputs(KernelSet<T>& set) {
  const auto fill = [&set](auto* step, bool mean, bool energy) {
    set.step[variant_index(axes, rule, mean, energy, residual)] = step;
  };
  fill(&StepOf<T, axes, rule, false, false, residual, false>::run, false, false);
#if !defined(BRISTLE_MINIMAL)
  fill(&StepOf<T, axes, rule, true, false, residual, false>::run, true, false);
  fill(&StepOf<T, axes, rule, false, true, residual, false>::run, false, true);
  fill(&StepOf<T, axes, rule, true, true, residual, false>::run, true, true);
#endif
}

template <class T, template <class, int, Rule, bool, bool, bool, bool> class StepOf, int axes>
constexpr void fill_axes(KernelSet<T>& set) {
  fill_outputs<T, StepOf, axes, rule_keep, false>(set);
#if !defined(BRISTLE_MINIMAL)
  fill_outputs<T, StepOf, axes, rule_redraw, false>(set);
  fill_outputs<T, StepOf, axes, rule_keep, true>(set);
  fill_outputs<T, StepOf, axes, rule_redraw, true>(set);
  set.step[variant_index(axes, rule_literal_keep, false, true, false)] =
      &StepOf<T, axes, rule_literal_keep, false, true, false, false>::run;
  set.step[variant_index(axes, rule_literal_redraw, false, true, false)] =
      &StepOf<T, axes, rule_literal_redraw, false, true, false, false>::run;
  set.step[aged_variant_index(axes, rule_keep)] = &StepOf<T, axes, rule_keep, true, true, true, true>::run;
  set.step[aged_variant_index(axes, rule_redraw)] =
      &StepOf<T, axes, rule_redraw, true, true, true, true>::run;
#endif
}

template <class T, int axes, bool redraw, template <class, int, bool, bool> class ForeseeOf, class Lengths>
constexpr void fill_renewal(KernelSet<T>& set) {
  set.foresee[axes - 1][redraw] = &ForeseeOf<T, axes, redraw, false>::run;
  set.foresee_aged[axes - 1][redraw] = &ForeseeOf<T, axes, redraw, true>::run;
  set.renew[axes - 1][redraw] = &renew_bristles<T, axes, redraw, false, Lengths>;
  set.renew_aged[axes - 1][redraw] = &renew_bristles<T, axes, redraw, true, Lengths>;
}

/// Fills the table of sliding kernels. `SlideOf` is that of slide_step.hpp or of slide_reference.hpp.
template <class T, int axes>
constexpr void fill_slide(KernelSet<T>& set) {
  auto& slide = set.slide[axes - 1];
  slide[0] = &SlideOf<T, axes, false, false, false>::run;
  slide[1] = &SlideOf<T, axes, true, false, false>::run;
  slide[2] = &SlideOf<T, axes, false, true, false>::run;
  slide[3] = &SlideOf<T, axes, true, true, false>::run;
  set.slide_aged[axes - 1] = &SlideOf<T, axes, true, true, true>::run;
}

template <class T, template <class, int, Rule, bool, bool, bool, bool> class StepOf,
          template <class, int, bool, bool> class ForeseeOf, class Lengths>
constexpr KernelSet<T> make_kernel_set(decltype(KernelSet<T>::rewrite) rewrite,
                                       decltype(KernelSet<T>::squares) squares) {
  KernelSet<T> set{};
  fill_axes<T, StepOf, 1>(set);
#if !defined(BRISTLE_MINIMAL)
  fill_axes<T, StepOf, 2>(set);
  fill_renewal<T, 1, false, ForeseeOf, Lengths>(set);
  fill_renewal<T, 1, true, ForeseeOf, Lengths>(set);
  fill_renewal<T, 2, false, ForeseeOf, Lengths>(set);
  fill_renewal<T, 2, true, ForeseeOf, Lengths>(set);
  fill_slide<T, 1>(set);
  fill_slide<T, 2>(set);
#endif
  set.rewrite = rewrite;
  set.squares = squares;
  return set;
}

}  // namespace
}  // namespace bristle::detail
