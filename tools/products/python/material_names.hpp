// Python names of the laws of snap lengths and of the snap rules.
#pragma once

#include "tools/products/python/keyword_class.hpp"

namespace bristle_python {

inline const Names<bristle::SnapLaw> law_names = {
    {"single", bristle::SnapLaw::single},           {"uniform", bristle::SnapLaw::uniform},
    {"normal", bristle::SnapLaw::normal},           {"lognormal", bristle::SnapLaw::lognormal},
    {"exponential", bristle::SnapLaw::exponential}, {"table", bristle::SnapLaw::table}};
inline const Names<bristle::SnapRule> rule_names = {{"redraw", bristle::SnapRule::redraw},
                                                    {"keep", bristle::SnapRule::keep},
                                                    {"slide", bristle::SnapRule::slide}};
inline const Names<bristle::DamperDecay> decay_names = {{"exponential", bristle::DamperDecay::exponential},
                                                        {"gaussian", bristle::DamperDecay::gaussian}};
inline const Names<bristle::AgeingForm> ageing_names = {{"logarithmic", bristle::AgeingForm::logarithmic},
                                                        {"saturating", bristle::AgeingForm::saturating}};

}  // namespace bristle_python
