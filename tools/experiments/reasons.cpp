// Why a model shows a phenomenon or does not, from its equations. For the default parameters.
#include <algorithm>
#include <initializer_list>

#include "tools/experiments/experiment.hpp"

namespace cli {
namespace {

struct Reason {
  const char* phenomenon;
  bool shown;
  std::initializer_list<std::string_view> models;
  const char* text;
};

constexpr std::string_view coulomb = "coulomb", dahl = "dahl", lugre = "lugre", plastic = "elasto_plastic",
                           maxwell = "maxwell_slip", gms = "gms", redraw = "brush_redraw",
                           keep = "brush_keep", infinite = "brush_infinite";

const Reason reasons[] = {
    {"hold", false, {coulomb}, "the regularised force needs a speed: it creeps at v_creep F / (mu N)"},
    {"hold",
     false,
     {dahl},
     "it has no damper: the block keeps ringing for a while on its spring, and its deflection gives way "
     "with every swing"},
    {"hold", true, {lugre}, "at constant force dz/dt = 0 means v = 0; the damper has ended the ringing"},
    {"hold", true, {plastic}, "elastic below its break-away deflection"},
    {"hold", true, {maxwell, gms}, "the elements that have not slipped carry the force elastically"},
    {"hold", true, {redraw, keep, infinite}, "where no bristle snaps nothing is left to give way: a spring"},
    {"drift_per_cycle", false, {coulomb}, "creeps in proportion to the mean force"},
    {"drift_per_cycle",
     false,
     {dahl, lugre},
     "dz = dx (1 - z/zss) on the way up, (1 + z/zss) on the way down: the same force is regained only "
     "further on"},
    {"drift_per_cycle",
     true,
     {plastic},
     "the cycle stays below the break-away deflection, where it is a pure spring"},
    {"drift_per_cycle",
     true,
     {maxwell, gms},
     "elements that slipped on the first way up are springs on all the later ways, but for ringing without a "
     "damper"},
    {"drift_per_cycle",
     true,
     {redraw, keep, infinite},
     "bristles that snapped on the first way up stand short of their next snap on all the later ways"},
    {"slope", false, {coulomb}, "creeps in proportion to the mean force"},
    {"slope", false, {dahl, lugre}, "every period of the shaking moves it on, as in a cycle of drift"},
    {"slope", true, {plastic}, "the shaking stays below the break-away deflection"},
    {"slope", true, {maxwell, gms}, "after the first period no element slips"},
    {"slope", true, {redraw, keep, infinite}, "after the first period no bristle snaps"},

    {"presliding", false, {coulomb}, "full friction from the creep velocity on: it contains no displacement"},
    {"presliding", true, {dahl, lugre, plastic}, "one bristle, a spring of stiffness sigma0 at first"},
    {"presliding", true, {maxwell, gms}, "springs in parallel"},
    {"presliding", true, {redraw, keep, infinite}, "all bristles bend before the first one snaps"},
    {"hysteresis", true, {coulomb}, "trivially: a rectangle, without presliding"},
    {"hysteresis", true, {dahl, lugre}, "the deflection gives way at every displacement"},
    {"hysteresis", false, {plastic}, "nearly a straight line: the loop hardly leaves the elastic range"},
    {"hysteresis", true, {maxwell, gms}, "elements slip one after the other"},
    {"hysteresis",
     true,
     {redraw, keep, infinite},
     "bristles snap, short ones first; below the shortest snap length (half the mean here) the loop is a "
     "line"},
    {"return_point", true, {coulomb}, "trivially: no memory, none needed"},
    {"return_point",
     false,
     {dahl, lugre},
     "one deflection remembers one reversal; the inner loop leaves the outer one elsewhere"},
    {"return_point", true, {plastic}, "trivially: these loops are elastic"},
    {"return_point",
     true,
     {maxwell, gms},
     "elements that did not slip in the inner loop return as they were (Masing's rules)"},
    {"return_point",
     true,
     {redraw, keep, infinite},
     "bristles that did not snap in the inner loop return as they were; one that snaps inside a loop "
     "forgets, so wide inner loops would not close exactly"},
    {"permanent_set", false, {coulomb}, "nothing springs back"},
    {"permanent_set", true, {dahl, lugre}, "the way in which the deflection gave way stays"},
    {"permanent_set", false, {plastic}, "elastic up to nine tenths of the peak, and hardly plastic at 95 %"},
    {"permanent_set", true, {maxwell, gms}, "elements that slipped pull back until the others balance them"},
    {"permanent_set",
     true,
     {redraw, keep, infinite},
     "bristles that snapped start again where they are, and balance the others"},

    {"static_peak", false, {coulomb, dahl, maxwell}, "one coefficient of friction; none is put in for rest"},
    {"static_peak", true, {lugre, plastic, gms}, "a parameter: the static force of the Stribeck curve"},
    {"static_peak",
     true,
     {redraw, keep, infinite},
     "emerges: in a first pull all bristles are bent alike; in sliding they are at every stage. No "
     "parameter, only the spread of the snap lengths"},
    {"peak_again", false, {coulomb, dahl, maxwell}, "one coefficient of friction; none is put in for rest"},
    {"peak_again", true, {lugre, plastic, gms}, "the Stribeck curve is back at the static force"},
    {"peak_again",
     false,
     {redraw, keep, infinite},
     "a stop changes no bristle: they stand at every stage, out of step, and continue as they slid. A full "
     "peak "
     "needs a new contact, or a first reversal"},
    {"break_away_rate", false, {coulomb, dahl, maxwell}, "no rate in them"},
    {"break_away_rate",
     true,
     {lugre},
     "the faster it moves through presliding, the lower the Stribeck curve it heads for"},
    {"break_away_rate",
     false,
     {plastic},
     "it falls by 3 % up to 20 N/s and rises again: it slides off within the narrow plastic band, and the "
     "damper adds"},
    {"break_away_rate", true, {gms}, "elements slip at the Stribeck force of their speed"},
    {"break_away_rate",
     false,
     {redraw, keep, infinite},
     "the elastic peak depends on the path alone and the damper adds to it: break-away rises, by up to 9 %"},
    {"break_away_load", true, {coulomb, dahl, maxwell}, "the limit of the force is mu N"},
    {"break_away_load",
     true,
     {lugre, plastic, gms},
     "the Stribeck force is in proportion to N; stiffness and damper are not, hence the small deviation"},
    {"break_away_load",
     true,
     {redraw, keep, infinite},
     "the number of bristles is in proportion to N (eq. 9), and with it all but the lubricant"},
    {"dwell_time",
     false,
     {coulomb, dahl, lugre, plastic, maxwell, gms, redraw, keep, infinite},
     "nothing in its equations changes while dx = 0"},

    {"stick_slip", false, {coulomb}, "no static peak: it settles at once"},
    {"stick_slip",
     false,
     {dahl, maxwell},
     "the swing left over from the start, which nothing damps; it does not stick"},
    {"stick_slip", true, {lugre, plastic, gms}, "friction falls with speed from the static force on"},
    {"stick_slip",
     false,
     {redraw, keep, infinite},
     "it slips once or twice and comes to slide: the lubricant takes more energy than the low peak after a "
     "stop gives"},

    {"stick_slip_dry", false, {coulomb}, "no static peak: it swings on undamped and does not stick"},
    {"stick_slip_dry",
     false,
     {dahl, maxwell},
     "the swing left over from the start, which nothing damps; it does not stick"},
    {"stick_slip_dry", true, {lugre, plastic, gms}, "friction falls with speed from the static force on"},
    {"stick_slip_dry",
     true,
     {redraw, keep, infinite},
     "the damper of the bent bristles holds it at low speed and lets go at high speed (eq. 5): a fall with "
     "speed beyond the Stribeck velocity"},

    {"lag", false, {coulomb, dahl, maxwell}, "force without memory of speed"},
    {"lag", true, {lugre, plastic}, "the deflection needs a way to follow the Stribeck curve"},
    {"lag", true, {gms}, "the elements follow the Stribeck curve at the attraction rate"},
    {"lag",
     false,
     {redraw, keep},
     "in one-way sliding the bristles' force depends on the path alone, and the damper's on the present "
     "speed "
     "alone; what is left is the fluctuation of finitely many bristles"},
    {"lag",
     false,
     {infinite},
     "in one-way sliding the bristles' force depends on the path alone, and the damper's on the present "
     "speed "
     "alone"},

    {"stribeck_fall", false, {coulomb, dahl, maxwell}, "no term that falls with speed"},
    {"stribeck_fall", true, {lugre, plastic, gms}, "put in as the Stribeck curve"},
    {"stribeck_fall",
     true,
     {redraw, keep, infinite},
     "the damper fades with speed (eq. 5): falls from the Stribeck velocity on"},
    {"stribeck_early", false, {coulomb, dahl, maxwell}, "no term that falls with speed"},
    {"stribeck_early", true, {lugre, plastic, gms}, "put in as the Stribeck curve"},
    {"stribeck_early",
     false,
     {redraw, keep, infinite},
     "kinetic + C v exp(-v/vs): it first rises with speed, up to the Stribeck velocity"},
    {"viscous_rise",
     true,
     {coulomb, lugre, plastic, gms, redraw, keep, infinite},
     "the lubricant term sigma2 v"},
    {"viscous_rise", false, {dahl, maxwell}, "their sources have no lubricant term"},
    {"dry_constant", true, {coulomb, dahl, maxwell}, "no speed in them"},
    {"dry_constant", true, {lugre, plastic, gms}, "the Stribeck curve has ended there"},
    {"dry_constant",
     true,
     {redraw, keep, infinite},
     "without damper and lubricant the force is one of the path alone"},

    {"load_up_sliding", false, {coulomb}, "algebraic: mu N at once"},
    {"load_up_sliding",
     true,
     {dahl, lugre, plastic, maxwell, gms},
     "the deflection must grow first; its stiffness does not depend on the load"},
    {"load_up_sliding", true, {redraw, keep, infinite}, "the bristles that come into contact are straight"},
    {"load_up_rest", true, {coulomb}, "trivially: at rest it has no force at all"},
    {"load_up_rest", true, {dahl, lugre, plastic, maxwell, gms}, "force from the deflection alone"},
    {"load_up_rest", true, {redraw, keep, infinite}, "new bristles are straight, the bent ones stay"},
    {"load_down_rest", true, {coulomb}, "trivially: at rest it has no force at all"},
    {"load_down_rest",
     false,
     {dahl, lugre, plastic, gms},
     "the deflection is only brought down by motion: at rest the old force stays, above what the load can "
     "hold"},
    {"load_down_rest", true, {maxwell}, "a block slips as soon as its limit falls below its spring's force"},
    {"load_down_rest", true, {redraw, keep, infinite}, "bristles that leave contact take their force along"},

    {"turn", false, {coulomb}, "at once: no memory"},
    {"turn",
     true,
     {dahl, lugre, plastic},
     "the deflection comes round over zss (the plane is an extension of the source)"},
    {"turn",
     true,
     {maxwell},
     "each block is dragged round on a tractrix (the plane is an extension of the source)"},
    {"turn",
     true,
     {gms},
     "at the attraction rate, in time and not over a way: it would turn faster at lower speed (the plane is "
     "an extension of the source)"},
    {"turn", true, {redraw, keep, infinite}, "each bristle keeps its sideways deflection until it snaps"},
    {"reversal", false, {coulomb}, "at once: no memory"},
    {"reversal", true, {dahl, lugre, plastic, maxwell, gms}, "the springs are unloaded first"},
    {"reversal", true, {redraw, keep, infinite}, "the bristles are unbent first"},

    {"proportional_to_load", true, {coulomb, dahl, lugre, plastic, maxwell, gms}, "put in as mu N"},
    {"proportional_to_load",
     true,
     {redraw, keep, infinite},
     "emerges from exponential heights: bristles in contact = N / (sigma_perp sigma), eq. 9"},
    {"representatives",
     true,
     {coulomb, dahl, lugre, plastic, maxwell, gms},
     "trivially: they have no bristles"},
    {"representatives",
     true,
     {redraw, keep},
     "each stands for as many as are left out; only the fluctuation changes"},
    {"representatives", true, {infinite}, "trivially: it has no number of bristles"},
    {"area", true, {coulomb, dahl, lugre, plastic, maxwell, gms}, "trivially: no area in them"},
    {"area",
     true,
     {redraw, keep, infinite},
     "on a larger area the surfaces stay further apart, and as many asperities touch (eqs. 7 and 8)"},
};

}  // namespace

std::string reason_of(std::string_view phenomenon, std::string_view model, bool shown) {
  for (const Reason& r : reasons) {
    if (r.phenomenon == phenomenon && r.shown == shown &&
        std::find(r.models.begin(), r.models.end(), model) != r.models.end()) {
      return r.text;
    }
  }
  return "";
}

}  // namespace cli
