// Why a model shows a phenomenon or does not, from its equations. For the default parameters.
#include <sstream>
#include <vector>

#include "tools/experiments/experiment.hpp"

namespace cli {
namespace {

/// Below each phenomenon: models that show it (+) or do not (-), and why. Brushes stand without brush_.
constexpr const char* reasons_text = R"(
hold
-coulomb: creeps at v_creep F / (mu N)
-dahl: has no damper: the block rings on its spring, and each swing moves it on
+lugre: at constant force dz/dt = 0 means v = 0
+elasto_plastic: elastic below its break-away deflection
+maxwell_slip gms slide slide_drop: elements that have not slipped carry the force as springs
+redraw keep infinite rubbed aged: where no bristle snaps it is a spring
+rate_state: creeps with exp(F / (a N)), and ever slower as its state ages
drift_per_cycle
-coulomb: creeps in proportion to the mean force
-dahl lugre: dz = dx (1 - z/zss) as the force rises, (1 + z/zss) as it falls: it regains the force only farther on
+elasto_plastic: the cycle stays below the break-away deflection
+maxwell_slip gms slide slide_drop: elements that slipped in the first rise of the force are springs later
+redraw keep infinite rubbed aged: after the first rise of the force no bristle snaps
+rate_state: creeps far more slowly than the threshold
slope
-coulomb: creeps in proportion to the mean force
-dahl lugre: every period of the shaking moves it on
+elasto_plastic: the shaking stays below the break-away deflection
+maxwell_slip gms slide slide_drop: after the first period no element slips
+redraw keep infinite rubbed aged: after the first period no bristle snaps
+rate_state: creeps far more slowly than the threshold
presliding
-coulomb: its force does not depend on displacement
+dahl lugre elasto_plastic: a spring of stiffness sigma0 at first
+maxwell_slip gms slide slide_drop: springs in parallel
+redraw keep infinite rubbed aged: all bristles bend before the first one snaps
+rate_state: a spring in series with the slider
hysteresis
+coulomb: a rectangle, without presliding
+dahl lugre: the deflection gives way at every displacement
-elasto_plastic: the loop hardly leaves the elastic range
+maxwell_slip gms slide slide_drop: elements slip one after the other
+redraw keep infinite rubbed: bristles snap, short ones first
-rate_state: the slider hardly moves until the force is near its friction
-aged: moved so slowly its bristles age, and hardly one snaps in these loops
return_point
+coulomb: has no memory
-dahl lugre: one deflection remembers one reversal only
+elasto_plastic: these loops are elastic
+maxwell_slip gms slide slide_drop: elements that did not slip in the inner loop return as they were (Masing)
+redraw keep infinite rubbed aged: bristles that did not snap in the inner loop return as they were; wide inner
 loops would not close exactly
-rate_state: the slider moves a little at each end of the outer loop
permanent_set
-coulomb: nothing springs back
+dahl lugre: the slip during the pull stays
-elasto_plastic: elastic up to nine tenths of the peak
+maxwell_slip gms slide slide_drop: elements that slipped pull back until the others balance them
+redraw keep infinite: bristles that snapped start again where they are, and balance the others
-rubbed aged: no bristle of the uniform law snaps before the peak
+rate_state: near its friction the slider moves, and stays
static_peak
-coulomb dahl maxwell_slip: has one coefficient of friction
+lugre elasto_plastic gms: the static force of the Stribeck curve is a parameter
+redraw keep infinite rubbed: in a first pull all bristles are bent alike, in sliding they are at every stage; no
 parameter but the spread of the snap lengths
+aged: as the rubbed brush; in the slowest pull its bristles have also grown stronger
+rate_state: starts with an aged state, which wears off in sliding
+slide slide_drop: the bristle damper adds; with a drop a bristle also holds more until it slides
peak_again
-coulomb dahl maxwell_slip: has one coefficient of friction
+lugre elasto_plastic gms: the Stribeck curve is back at the static force
-redraw keep infinite rubbed: a stop changes no bristle: a full peak needs a new contact or a first reversal
+rate_state: at rest its state ages
+aged: at rest the snap lengths grow with the logarithm of the time
+slide_drop: a bristle that has stuck holds its static limit again
-slide: has no static limit
break_away_rate
-coulomb dahl maxwell_slip: has no rate
+lugre: it heads for the Stribeck curve of its speed
-elasto_plastic: falls by 3 % up to 20 N/s, then the damper makes it rise
+gms: elements slip at the Stribeck force of their speed
-redraw keep infinite rubbed slide_drop: the elastic peak depends on the path alone, and the damper adds up to 9 %
+rate_state: the faster the force grows, the less time the state has to age
+aged: the faster the force grows, the less time the snap lengths have to grow
+slide: the bristle damper adds to a slow pull and has faded in a fast one (eq. 5)
break_away_load
+coulomb dahl maxwell_slip slide slide_drop: the limit of the force is mu N
+lugre elasto_plastic gms: the Stribeck force is proportional to N; stiffness and damper are not
+redraw keep infinite rubbed aged: the number of bristles is proportional to N (eq. 9)
+rate_state: a, b and mu0 are shares of the load; the spring is not
dwell_time
-coulomb dahl lugre elasto_plastic maxwell_slip gms redraw keep infinite rubbed slide slide_drop: nothing in
 its equations changes while dx = 0
+rate_state: its state is the time at rest
+aged: its snap lengths grow with the logarithm of their age: by 1.75 beta of friction per e-fold (2 beta without
 residual and renewal)
stick_slip
-coulomb: no static peak
-dahl maxwell_slip: an undamped swing from the start, which does not stick
+lugre elasto_plastic gms: friction falls with speed from the static force on
-redraw keep infinite rubbed slide slide_drop: slips once or twice: the lubricant takes more energy than the low peak
 gives
+rate_state: friction grows at rest and falls with speed
+aged: while it sticks its snap lengths grow; a slip ends in fresh bristles
stick_slip_dry
-coulomb: an undamped swing from the start, which does not stick
-dahl maxwell_slip: an undamped swing from the start, which does not stick
+lugre elasto_plastic gms: friction falls with speed from the static force on
+redraw keep infinite rubbed slide slide_drop: the damper of bent bristles fades beyond the Stribeck velocity (eq.
 5), so friction falls with speed
+rate_state: friction grows at rest and falls with speed
+aged: while it sticks its snap lengths grow; a slip ends in fresh bristles
lag
-coulomb dahl maxwell_slip: no memory of speed
+lugre elasto_plastic: the deflection follows the Stribeck curve over a path
+gms: the elements follow the Stribeck curve at the attraction rate
-redraw keep: one-way sliding has no memory of speed; the value is the noise of finitely many bristles
-infinite rubbed: one-way sliding has no memory of speed
+rate_state: the state follows the speed over a path Dc
+aged: bristles bent while it was slow are older
-slide slide_drop: bristles lie along the motion, whatever its speed
stribeck_fall
-coulomb dahl maxwell_slip: no term that falls with speed
+lugre elasto_plastic gms: the Stribeck curve is a parameter
+redraw keep infinite rubbed slide slide_drop: the damper fades from the Stribeck velocity on (eq. 5)
+aged: fast bristles snap young; the damper fades (eq. 5)
+rate_state: b is larger than a
stribeck_early
-coulomb dahl maxwell_slip: no term that falls with speed
+lugre elasto_plastic gms: the Stribeck curve is a parameter
-redraw keep infinite rubbed slide slide_drop: kinetic + C v exp(-v/vs) rises up to the Stribeck velocity
+rate_state: b is larger than a, at every speed
+aged: the slower it slides, the older a bristle becomes before it snaps
viscous_rise
+coulomb lugre elasto_plastic gms redraw keep infinite rubbed aged slide slide_drop: the lubricant term sigma2 v
-dahl maxwell_slip rate_state: their sources have no lubricant term
dry_constant
+coulomb dahl maxwell_slip: has no speed
+lugre elasto_plastic gms: the Stribeck curve has ended there
+redraw keep infinite rubbed slide slide_drop: without damper and lubricant the force depends on the path alone
+aged: at these speeds a bristle snaps before it has aged
-rate_state: its friction falls with the logarithm of every speed
load_up_sliding
-coulomb: mu N at once
+dahl lugre elasto_plastic maxwell_slip gms rate_state: the deflection must grow first
+redraw keep infinite rubbed aged: bristles that come into contact are straight
+slide slide_drop: the stiffer bristles must bend up to their limits first
load_up_rest
+coulomb: has no force at rest
+dahl lugre elasto_plastic maxwell_slip gms rate_state: force from the deflection alone
+redraw keep infinite rubbed aged: new bristles are straight, the bent ones stay
+slide slide_drop: a rising load stiffens bristles at the force that they have
load_down_rest
+coulomb: has no force at rest
-dahl lugre elasto_plastic gms: only motion reduces the deflection
+maxwell_slip slide slide_drop: a block slips where its limit falls below its force
+redraw keep infinite rubbed aged: bristles that leave contact take their force along
+rate_state: its slider slips where the force exceeds what the load holds
turn
-coulomb: no memory
+dahl lugre elasto_plastic rate_state: the deflection turns over the path that stretches it (the plane extends the
 source)
+maxwell_slip slide slide_drop: each block is dragged round on a tractrix (the plane extends the source)
+gms: at its attraction rate: in time, not over a path (the plane extends the source)
+redraw keep infinite rubbed aged: each bristle keeps its sideways deflection until it snaps
reversal
-coulomb: no memory
+dahl lugre elasto_plastic maxwell_slip gms rate_state slide slide_drop: the springs are unloaded first
+redraw keep infinite rubbed aged: the reversed motion first unbends the bristles
proportional_to_load
+coulomb dahl lugre elasto_plastic maxwell_slip gms rate_state: put in as mu N
+redraw keep infinite rubbed aged: follows from exponential heights (eq. 9)
+slide slide_drop: limits follow the load
representatives
+coulomb dahl lugre elasto_plastic maxwell_slip gms rate_state: has no bristles
+redraw keep: only the fluctuation depends on it
+infinite rubbed aged slide slide_drop: has no number of bristles
area
+coulomb dahl lugre elasto_plastic maxwell_slip gms rate_state: has no area
+redraw keep infinite rubbed aged slide slide_drop: as many asperities touch on a larger area (eqs. 7 and 8)
hardening
+coulomb: no memory
+dahl lugre elasto_plastic maxwell_slip gms rate_state slide slide_drop: limits do not depend on the past
-redraw infinite: a bristle that draws a length beyond the stroke never snaps again; in time all have one
+keep: bristles keep their lengths
+rubbed aged: the snaps of some bristles renew others, which draw again
loop_work
+coulomb: no memory
+dahl lugre elasto_plastic maxwell_slip gms rate_state slide slide_drop: loops repeat from the second on
-redraw infinite: bristles with long lengths do not snap: nothing is lost
+keep: bristles keep their lengths and snap in every loop
+rubbed aged: long lengths are drawn and renewed at one rate
open_loops
+coulomb: full friction at once
+dahl lugre: the deflection gives way at every displacement
-rate_state: at half a length the force is far below its friction
-elasto_plastic: elastic up to nine tenths of the static force
+maxwell_slip gms slide: elements slip one after the other, in every loop
-redraw keep infinite rubbed aged: few bristles are short enough to snap at half a length, and those draw longer
 ones
-slide_drop: half a length slides no bristle
lasts_from
+coulomb dahl lugre elasto_plastic maxwell_slip gms rate_state keep slide slide_drop: loops repeat from the second on
-redraw infinite: hardens unless the stroke is far beyond the longest lengths
+rubbed aged: enough bristles snap to renew the others
tremor
+coulomb: no memory
+dahl lugre elasto_plastic maxwell_slip gms rate_state slide slide_drop: limits do not depend on the past
-redraw infinite: long lengths gather
+keep: bristles keep their lengths
+rubbed aged: bristles are renewed with every swing
circle
+coulomb: no memory
+dahl lugre elasto_plastic maxwell_slip gms rate_state slide slide_drop: the force repeats from the second turn on
-redraw infinite: bristles with lengths beyond the circle never snap again
+keep: bristles keep their lengths
+rubbed aged: bristles that are bent along the motion are renewed
ratchet
-coulomb: creeps in proportion to the mean force
-dahl lugre: as under a wavering force
-elasto_plastic: the highest forces reach its plastic band
+elasto_plastic: these forces stay below the break-away deflection
+maxwell_slip gms slide slide_drop: elements that slipped in the first rise of the force are springs later
+redraw keep infinite rubbed aged: after the first cycles no bristle snaps
+rate_state: creeps far more slowly than the threshold
ratchet_taps
-coulomb: creeps in proportion to the mean force
-dahl lugre: every tap moves it on
-elasto_plastic: the taps reach its plastic band
+elasto_plastic: the taps stay below the break-away deflection
+maxwell_slip gms slide slide_drop: after the first cycles no element slips
+redraw keep infinite rubbed aged: after the first cycles no bristle snaps
+rate_state: creeps far more slowly than the threshold
echo
+coulomb dahl lugre elasto_plastic maxwell_slip gms rate_state slide slide_drop: sliding has one state
+redraw infinite rubbed aged: a few fresh lengths erase the past
-keep: every bristle snaps at fixed places for ever: all are straight together where they began
healing
-coulomb dahl lugre elasto_plastic maxwell_slip gms redraw keep infinite rubbed slide slide_drop: nothing in
 its equations changes while dx = 0
+rate_state: b ln(1 + v t / Dc), less the wear of the state while the spring is stretched again
+aged: snap lengths grow with the logarithm of their age
hold_relaxation
-coulomb dahl lugre elasto_plastic maxwell_slip gms redraw keep infinite rubbed slide slide_drop: nothing in
 its equations changes while dx = 0
-aged: bristles do not creep; in real contacts ageing and creep go together
+rate_state: the slider creeps and unloads the spring
direct_effect
-coulomb dahl maxwell_slip: has no speed
-lugre elasto_plastic gms: friction approaches the Stribeck curve of the new speed from that of the old one
-redraw keep infinite rubbed slide slide_drop: the damper adds in proportion to the speed, not to its logarithm
-aged: Material::with_speed_strengthening adds it, zero here: with strengthening=0.008 it is 1.94 % per e-fold, but
 the contact creeps under a constant force and does not stick and slip
+rate_state: a ln(v2 / v1)
speed_fall
-coulomb dahl maxwell_slip: has no speed
-lugre elasto_plastic gms: the Stribeck curve falls near the Stribeck velocity only
-redraw keep infinite rubbed slide slide_drop: the damper makes friction rise
+rate_state: b is larger than a
+aged: the faster it slides, the younger its bristles are when they snap
evolution_way
-coulomb dahl maxwell_slip lugre elasto_plastic gms redraw keep infinite rubbed slide slide_drop: friction
 does not fall at such speeds
+rate_state: the state wears off over Dc
+aged: until every bristle has snapped once
critical_stiffness
-coulomb dahl maxwell_slip slide slide_drop: friction does not fall with speed
+lugre elasto_plastic gms: friction falls with speed, though little at such speeds
-redraw keep infinite rubbed: the damper makes friction rise with speed
+rate_state: (b - a) N / Dc, behind the contact's own spring
+aged: friction falls with speed, over a path
linear_theory
+coulomb dahl maxwell_slip redraw keep infinite rubbed slide slide_drop: neither finds stick-slip
+lugre elasto_plastic gms rate_state: a small disturbance grows where theory says
+aged: a small disturbance grows where theory says, for every strength of ageing (tools/README.md)
limit_surface
+coulomb dahl lugre elasto_plastic maxwell_slip gms redraw keep infinite rubbed aged slide slide_drop: every
 cell resists its own motion; the rest is the error of dividing the disc
-rate_state: slow cells have more friction than fast ones
spin_eases
+coulomb dahl lugre elasto_plastic maxwell_slip gms rate_state redraw keep infinite rubbed aged slide
 slide_drop: the slide turns the friction of the spinning cells only a little
torsion_spring
-coulomb: no spring
+dahl lugre elasto_plastic maxwell_slip gms rate_state redraw keep infinite rubbed aged slide slide_drop: a
 spring in every cell
spin_peak
-coulomb dahl maxwell_slip slide: its force has no peak either
-lugre elasto_plastic gms: at a constant speed nothing exceeds the steady force
-rate_state: its contact begins as if it had slid before
+redraw keep infinite rubbed aged: bristles of the rim, which carry most of the torque, bend together
+slide_drop: bristles hold more until they slide
spin_peak_share
-coulomb dahl lugre elasto_plastic maxwell_slip gms rate_state slide: no peak in either motion
+redraw keep infinite rubbed aged: rings reach their snap one after the other, from the rim inwards
+slide_drop: the rim slides before the middle
peak_lost
-coulomb dahl lugre elasto_plastic maxwell_slip gms rate_state slide: no peak from rest at this speed
+redraw keep infinite rubbed aged: bristles that snap are at all stages of their bending
+slide_drop: bristles that spin slide already
coin_ratio
+coulomb dahl lugre elasto_plastic maxwell_slip rate_state redraw keep infinite rubbed aged slide slide_drop:
 presliding is short beside the path
-gms: its slipping elements turn in a time (1 / C = 10 ms), not over a path
stops_at_once
+coulomb dahl lugre elasto_plastic maxwell_slip gms rate_state redraw keep infinite rubbed aged slide
 slide_drop: while it spins, friction against the slide is weak, and vice versa
corner_moment
+coulomb dahl lugre elasto_plastic maxwell_slip gms redraw keep infinite rubbed aged slide slide_drop: every
 cell resists with its friction
-rate_state: slow cells near the corner have more friction
corner_holds
-coulomb: creeps in proportion to the mean moment
-dahl lugre: every cell drifts as the point does
+elasto_plastic: cells stay below their break-away deflection
+maxwell_slip gms: after the first period no element slips
+redraw keep infinite rubbed aged slide slide_drop: after the first period no bristle snaps
-rate_state: creeps on, ever slower)";

struct Reason {
  std::string phenomenon, text;  ///< "MODEL MODEL: why"
  bool shown;
};

std::vector<Reason> read_reasons() {
  std::vector<Reason> all;
  std::string phenomenon;
  std::istringstream lines(reasons_text);
  for (std::string line; std::getline(lines, line);) {
    if (line[0] == ' ')  // goes on
      all.back().text += line;
    else if (line[0] == '+' || line[0] == '-')
      all.push_back({phenomenon, line.substr(1), line[0] == '+'});
    else
      phenomenon = line;
  }
  return all;
}

}  // namespace

std::string reason_of(std::string_view phenomenon, std::string_view model, bool shown) {
  static const std::vector<Reason> reasons = read_reasons();
  const std::string name = ' ' + std::string(model.starts_with("brush_") ? model.substr(6) : model) + ' ';
  for (const Reason& r : reasons) {
    const std::size_t colon = r.text.find(": ");
    const std::string models = ' ' + r.text.substr(0, colon) + ' ';
    if (r.phenomenon == phenomenon && r.shown == shown && models.find(name) != std::string::npos)
      return r.text.substr(colon + 2);
  }
  return "";
}

}  // namespace cli
