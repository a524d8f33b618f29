// Why a model shows a phenomenon or does not, from its equations. For the default parameters.
#include <sstream>
#include <vector>

#include "tools/experiments/experiment.hpp"

namespace cli {
namespace {

/// Below each phenomenon: models that show it (+) or do not (-), and why. Brushes stand without brush_.
constexpr const char* reasons_text = R"(
hold
-coulomb: the regularised force needs a speed: it creeps at v_creep F / (mu N)
-dahl: it has no damper: the block keeps ringing for a while on its spring, and its deflection gives way with
 every swing
+lugre: at constant force dz/dt = 0 means v = 0; the damper has ended the ringing
+elasto_plastic: elastic below its break-away deflection
+maxwell_slip gms slide slide_drop: the elements that have not slipped carry the force elastically
+redraw keep infinite rubbed aged: where no bristle snaps nothing is left to give way: a spring
+rate_state: far below its friction it creeps with exp(F / (a N)), and ever slower as its state ages
drift_per_cycle
-coulomb: creeps in proportion to the mean force
-dahl lugre: dz = dx (1 - z/zss) on the way up, (1 + z/zss) on the way down: the same force is regained only
 further on
+elasto_plastic: the cycle stays below the break-away deflection, where it is a pure spring
+maxwell_slip gms slide slide_drop: elements that slipped on the first way up are springs on all the later
 ways, but for ringing without a damper
+redraw keep infinite rubbed aged: bristles that snapped on the first way up stand short of their next snap on
 all the later ways
+rate_state: its creep is far slower than this
slope
-coulomb: creeps in proportion to the mean force
-dahl lugre: every period of the shaking moves it on, as in a cycle of drift
+elasto_plastic: the shaking stays below the break-away deflection
+maxwell_slip gms slide slide_drop: after the first period no element slips
+redraw keep infinite rubbed aged: after the first period no bristle snaps
+rate_state: its creep is far slower than this
presliding
-coulomb: full friction from the creep velocity on: it contains no displacement
+dahl lugre elasto_plastic: one bristle, a spring of stiffness sigma0 at first
+maxwell_slip gms slide slide_drop: springs in parallel
+redraw keep infinite rubbed aged: all bristles bend before the first one snaps
+rate_state: a spring of stiffness sigma0 at first, behind it the slider
hysteresis
+coulomb: trivially: a rectangle, without presliding
+dahl lugre: the deflection gives way at every displacement
-elasto_plastic: nearly a straight line: the loop hardly leaves the elastic range
+maxwell_slip gms slide slide_drop: elements slip one after the other
+redraw keep infinite rubbed: bristles snap, short ones first; below the shortest snap length (half the mean
 here) the loop is a line
-rate_state: nearly a straight line: the slider hardly moves until the force is near its friction
-aged: moved so slowly its bristles have aged: hardly one is short enough to snap in these loops
return_point
+coulomb: trivially: no memory, none needed
-dahl lugre: one deflection remembers one reversal; the inner loop leaves the outer one elsewhere
+elasto_plastic: trivially: these loops are elastic
+maxwell_slip gms slide slide_drop: elements that did not slip in the inner loop return as they were (Masing's
 rules)
+redraw keep infinite rubbed aged: bristles that did not snap in the inner loop return as they were; one that
 snaps inside a loop forgets, so wide inner loops would not close exactly
-rate_state: the slider moves near the ends of the outer loop only, a little more each time
permanent_set
-coulomb: nothing springs back
+dahl lugre: the way in which the deflection gave way stays
-elasto_plastic: elastic up to nine tenths of the peak, and hardly plastic at 95 %
+maxwell_slip gms slide slide_drop: elements that slipped pull back until the others balance them
+redraw keep infinite: bristles that snapped start again where they are, and balance the others
-rubbed aged: its peak is where the shortest bristles of the uniform law begin to snap: let go short of it, it
 springs back all the way.
+rate_state: near its friction the slider moves, and stays there
static_peak
-coulomb dahl maxwell_slip: one coefficient of friction; none is put in for rest
+lugre elasto_plastic gms: a parameter: the static force of the Stribeck curve
+redraw keep infinite rubbed: emerges: in a first pull all bristles are bent alike; in sliding they are at
 every stage. No parameter, only the spread of the snap lengths
+aged: in a first pull all bristles are bent alike, and those of the slowest pull have aged
+rate_state: it starts with an aged state, which wears off in sliding
+slide slide_drop: the bristle damper adds at the speed of the pull; and with a drop a bristle holds more
 until it slides
peak_again
-coulomb dahl maxwell_slip: one coefficient of friction; none is put in for rest
+lugre elasto_plastic gms: the Stribeck curve is back at the static force
-redraw keep infinite rubbed: a stop changes no bristle: they stand at every stage, out of step, and continue
 as they slid. A full peak needs a new contact, or a first reversal
+rate_state: at rest its state ages
+aged: at rest the snap lengths grow with the logarithm of the time
+slide_drop: a bristle that has stuck holds its whole limit again
-slide: without a drop a bristle that has stuck holds what it held
break_away_rate
-coulomb dahl maxwell_slip: no rate in them
+lugre: the faster it moves through presliding, the lower the Stribeck curve it heads for
-elasto_plastic: it falls by 3 % up to 20 N/s and rises again: it slides off within the narrow plastic band,
 and the damper adds
+gms: elements slip at the Stribeck force of their speed
-redraw keep infinite rubbed slide_drop: the elastic peak depends on the path alone and the damper adds to it:
 break-away rises, by up to 9 %
+rate_state: the faster the force grows, the less time the state has to age
+aged: the faster the force grows, the less time the snap lengths have to grow
+slide: the bristle damper adds to a slow pull and has faded in a fast one (eq. 5)
break_away_load
+coulomb dahl maxwell_slip slide slide_drop: the limit of the force is mu N
+lugre elasto_plastic gms: the Stribeck force is in proportion to N; stiffness and damper are not, hence the
 small deviation
+redraw keep infinite rubbed aged: the number of bristles is in proportion to N (eq. 9), and with it all but
 the lubricant
+rate_state: a, b and mu0 are shares of the load; the spring is not, hence the small deviation
dwell_time
-coulomb dahl lugre elasto_plastic maxwell_slip gms redraw keep infinite rubbed slide slide_drop: nothing in
 its equations changes while dx = 0
+rate_state: its state is the time at rest: b N per e-fold
+aged: its snap lengths grow with the logarithm of their age: for small beta 2 beta of friction per e-fold,
 1.75 beta with this residual and renewal
stick_slip
-coulomb: no static peak: it settles at once
-dahl maxwell_slip: the swing left over from the start, which nothing damps; it does not stick
+lugre elasto_plastic gms: friction falls with speed from the static force on
-redraw keep infinite rubbed slide slide_drop: it slips once or twice and comes to slide: the lubricant takes
 more energy than the low peak after a stop gives
+rate_state: friction grows at rest and falls with speed
+aged: while it sticks its snap lengths grow: each slip begins at a peak, and ends in fresh bristles
stick_slip_dry
-coulomb: no static peak: it swings on undamped and does not stick
-dahl maxwell_slip: the swing left over from the start, which nothing damps; it does not stick
+lugre elasto_plastic gms: friction falls with speed from the static force on
+redraw keep infinite rubbed slide slide_drop: the damper of the bent bristles holds it at low speed and lets
 go at high speed (eq. 5): a fall with speed beyond the Stribeck velocity
+rate_state: friction grows at rest and falls with speed
+aged: while it sticks its snap lengths grow: each slip begins at a peak, and ends in fresh bristles
lag
-coulomb dahl maxwell_slip: force without memory of speed
+lugre elasto_plastic: the deflection needs a way to follow the Stribeck curve
+gms: the elements follow the Stribeck curve at the attraction rate
-redraw keep: in one-way sliding the bristles' force depends on the path alone, and the damper's on the
 present speed alone; what is left is the fluctuation of finitely many bristles
-infinite rubbed: in one-way sliding the bristles' force depends on the path alone, and the damper's on the
 present speed alone
+rate_state: the state needs a way of Dc to follow the speed; the direct effect is the larger part of the
 swing of the force, but not at equal speeds
+aged: bristles carry the age they have: those bent while it was slow are older
-slide slide_drop: the bristles lie along the motion, whatever its speed
stribeck_fall
-coulomb dahl maxwell_slip: no term that falls with speed
+lugre elasto_plastic gms: put in as the Stribeck curve
+redraw keep infinite rubbed slide slide_drop: the damper fades with speed (eq. 5): falls from the Stribeck
 velocity on
+aged: the faster it slides, the younger its bristles are when they snap; its damper fades with speed (eq. 5)
+rate_state: b is larger than a
stribeck_early
-coulomb dahl maxwell_slip: no term that falls with speed
+lugre elasto_plastic gms: put in as the Stribeck curve
-redraw keep infinite rubbed slide slide_drop: kinetic + C v exp(-v/vs): it first rises with speed, up to the
 Stribeck velocity
+rate_state: b is larger than a, at every speed
+aged: the slower it slides, the older a bristle becomes before it snaps: beta of the friction that is not
 residual per e-fold of speed
viscous_rise
+coulomb lugre elasto_plastic gms redraw keep infinite rubbed aged slide slide_drop: the lubricant term sigma2
 v
-dahl maxwell_slip rate_state: their sources have no lubricant term
dry_constant
+coulomb dahl maxwell_slip: no speed in them
+lugre elasto_plastic gms: the Stribeck curve has ended there
+redraw keep infinite rubbed slide slide_drop: without damper and lubricant the force is one of the path alone
+aged: at these speeds a bristle snaps before it has aged
-rate_state: its friction falls with the logarithm of the speed for ever: no speed is away from rest
load_up_sliding
-coulomb: algebraic: mu N at once
+dahl lugre elasto_plastic maxwell_slip gms rate_state: the deflection must grow first; its stiffness does not
 depend on the load
+redraw keep infinite rubbed aged: the bristles that come into contact are straight
+slide slide_drop: the stiffer bristles must bend up to their limits first
load_up_rest
+coulomb: trivially: at rest it has no force at all
+dahl lugre elasto_plastic maxwell_slip gms rate_state: force from the deflection alone
+redraw keep infinite rubbed aged: new bristles are straight, the bent ones stay
+slide slide_drop: a load that rises stiffens the bristles at the force that they have
load_down_rest
+coulomb: trivially: at rest it has no force at all
-dahl lugre elasto_plastic gms: the deflection is only brought down by motion: at rest the old force stays,
 above what the load can hold
+maxwell_slip slide slide_drop: a block slips as soon as its limit falls below its spring's force
+redraw keep infinite rubbed aged: bristles that leave contact take their force along
+rate_state: its slider slips as soon as the force is above what the load holds
turn
-coulomb: at once: no memory
+dahl lugre elasto_plastic rate_state: the deflection comes round over the way that stretches it (the plane is
 an extension of the source)
+maxwell_slip slide slide_drop: each block is dragged round on a tractrix (the plane is an extension of the
 source)
+gms: at the attraction rate, in time and not over a way: it would turn faster at lower speed (the plane is an
 extension of the source)
+redraw keep infinite rubbed aged: each bristle keeps its sideways deflection until it snaps
reversal
-coulomb: at once: no memory
+dahl lugre elasto_plastic maxwell_slip gms rate_state slide slide_drop: the springs are unloaded first
+redraw keep infinite rubbed aged: the bristles are unbent first
proportional_to_load
+coulomb dahl lugre elasto_plastic maxwell_slip gms rate_state: put in as mu N
+redraw keep infinite rubbed aged: emerges from exponential heights: bristles in contact = N / (sigma_perp
 sigma), eq. 9
+slide slide_drop: limits follow the load
representatives
+coulomb dahl lugre elasto_plastic maxwell_slip gms rate_state: trivially: they have no bristles
+redraw keep: each stands for as many as are left out; only the fluctuation changes
+infinite rubbed aged slide slide_drop: trivially: it has no number of bristles
area
+coulomb dahl lugre elasto_plastic maxwell_slip gms rate_state: trivially: no area in them
+redraw keep infinite rubbed aged slide slide_drop: on a larger area the surfaces stay further apart, and as
 many asperities touch (eqs. 7 and 8)
hardening
+coulomb: no memory
+dahl lugre elasto_plastic maxwell_slip gms rate_state slide slide_drop: its limits do not depend on what was
 done
-redraw infinite: a bristle that draws a length beyond the stroke never snaps again; the others go on drawing
 until they have one too
+keep: bristles keep their lengths
+rubbed aged: where one bristle snaps others are renewed, and draw again
loop_work
+coulomb: no memory
+dahl lugre elasto_plastic maxwell_slip gms rate_state slide slide_drop: loops repeat from the second on
-redraw infinite: bristles that have drawn long lengths no longer snap: nothing is lost
+keep: bristles keep their lengths and snap in every loop
+rubbed aged: long lengths are drawn and renewed at one rate
open_loops
+coulomb: trivially: full friction at once
+dahl lugre: the deflection gives way at every displacement
-rate_state: a spring: at half a length the force is far below its friction
-elasto_plastic: elastic up to nine tenths of the static force
+maxwell_slip gms slide: elements slip one after the other, in every loop
-redraw keep infinite rubbed aged: hardly a bristle is short enough to snap at half a length, and the few that
 are draw longer lengths
-slide_drop: its limits are far from zero: half a length to either side slides no bristle
lasts_from
+coulomb dahl lugre elasto_plastic maxwell_slip gms rate_state keep slide slide_drop: loops repeat from the
 second on
-redraw infinite: rubbing ends only where the stroke is far beyond the longest lengths
+rubbed aged: from there on enough bristles snap to renew the others
tremor
+coulomb: no memory
+dahl lugre elasto_plastic maxwell_slip gms rate_state slide slide_drop: its limits do not depend on what was
 done
-redraw infinite: as under strokes: long lengths gather
+keep: bristles keep their lengths
+rubbed aged: bristles are renewed with every swing
circle
+coulomb: no memory
+dahl lugre elasto_plastic maxwell_slip gms rate_state slide slide_drop: the force follows the direction from
 the second turn on
-redraw infinite: bristles that have drawn lengths beyond the circle never snap again
+keep: bristles keep their lengths
+rubbed aged: bristles that are bent along the motion are renewed
ratchet
-coulomb: creeps in proportion to the mean force
-dahl lugre: as in a cycle of drift: the same force is regained only further on
-elasto_plastic: the highest forces reach its plastic band
+elasto_plastic: these forces stay below the break-away deflection
+maxwell_slip gms slide slide_drop: elements that slipped on the first way up are springs on all the later
 ways
+redraw keep infinite rubbed aged: bristles that snapped in the first cycles stand short of their next snap;
 nothing snaps, nothing is renewed
+rate_state: its creep is far slower than this
ratchet_taps
-coulomb: creeps in proportion to the mean force
-dahl lugre: every tap moves it on, as a cycle of drift does
-elasto_plastic: the taps reach its plastic band
+elasto_plastic: the taps stay below the break-away deflection
+maxwell_slip gms slide slide_drop: after the first cycles no element slips
+redraw keep infinite rubbed aged: after the first cycles no bristle snaps
+rate_state: its creep is far slower than this
echo
+coulomb dahl lugre elasto_plastic maxwell_slip gms rate_state slide slide_drop: sliding has one state,
 whatever came before
+redraw infinite rubbed aged: fresh lengths: what was is forgotten after a few of them
-keep: every bristle is on its own lattice for ever: all are straight together where they were at first
healing
-coulomb dahl lugre elasto_plastic maxwell_slip gms redraw keep infinite rubbed slide slide_drop: nothing in
 its equations changes while dx = 0
+rate_state: b ln(1 + v t / Dc), less what the state wears off while the spring is stretched again
+aged: snap lengths grow with the logarithm of their age: for small beta 1.75 beta per e-fold (2 beta without
 residual and renewal), over g of the hold
hold_relaxation
-coulomb dahl lugre elasto_plastic maxwell_slip gms redraw keep infinite rubbed slide slide_drop: nothing in
 its equations changes while dx = 0
-aged: bristles hold longer as they age, but do not creep: in real contacts both go together
+rate_state: the slider creeps on and unloads the spring
direct_effect
-coulomb dahl maxwell_slip: no speed in them
-lugre elasto_plastic gms: friction comes down to the Stribeck curve of the new speed, from the old one: never
 above either
-redraw keep infinite rubbed slide slide_drop: the damper adds in proportion to the speed, not to its
 logarithm: ten times as much at ten times the speed
-aged: ageing alone does not show it: snap lengths do not know the speed of the moment.
 Material::with_speed_strengthening adds it, zero here, for the column shows what ageing does: with
 strengthening=0.008 it is 1.94 % per e-fold where a ln(v2 / v1) is 2 %, and the rows hold, dry and lubricated
 stick-slip say no: a logarithm of the speed creeps, and rises at high speed
+rate_state: a ln(v2 / v1), less what wears off until the first look
speed_fall
-coulomb dahl maxwell_slip: no speed in them
-lugre elasto_plastic gms: the Stribeck curve is flat at such speeds: it falls near the Stribeck velocity
 alone
-redraw keep infinite rubbed slide slide_drop: the damper makes friction rise
+rate_state: b is larger than a
+aged: the faster it slides, the younger its bristles are when they snap
evolution_way
-coulomb dahl maxwell_slip lugre elasto_plastic gms redraw keep infinite rubbed slide slide_drop: friction
 does not fall at such speeds
+rate_state: the state wears off over Dc
+aged: until every bristle has snapped once: about a length
critical_stiffness
-coulomb dahl maxwell_slip slide slide_drop: friction does not fall with speed
+lugre elasto_plastic gms: friction falls with speed, though little at such speeds
-redraw keep infinite rubbed: the damper makes friction rise with speed
+rate_state: (b - a) N / Dc, behind the contact's own spring
+aged: friction falls with speed, and over a way
linear_theory
+coulomb dahl maxwell_slip redraw keep infinite rubbed slide slide_drop: trivially: neither finds stick-slip
+lugre elasto_plastic gms rate_state: a small disturbance grows where it says
+aged: a small disturbance grows where it says, for every strength of ageing and dampings that end swings
 which the steps resolve (tools/README.md)
limit_surface
+coulomb dahl lugre elasto_plastic maxwell_slip gms redraw keep infinite rubbed aged slide slide_drop: every
 cell slides with its friction against its own motion; what is left is the error of cutting
-rate_state: its friction falls with the logarithm of the speed: slow cells have more than fast ones
spin_eases
+coulomb dahl lugre elasto_plastic maxwell_slip gms rate_state redraw keep infinite rubbed aged slide
 slide_drop: the slide turns the friction of the spinning cells only a little
torsion_spring
-coulomb: no spring: from the creep velocity on its torque is that of sliding
+dahl lugre elasto_plastic maxwell_slip gms rate_state redraw keep infinite rubbed aged slide slide_drop: a
 spring in every cell
spin_peak
-coulomb dahl maxwell_slip slide: its force has no peak at a first pull either
-lugre elasto_plastic gms: its static friction is that of slow motion: at a constant speed nothing is above
 the steady force
-rate_state: its contact begins as if it had slid before, not as if it had rested
+redraw keep infinite rubbed aged: the bristles of the rim, which carry most of the torque, bend together
 before the first one snaps
+slide_drop: bristles hold more until they slide
spin_peak_share
-coulomb dahl lugre elasto_plastic maxwell_slip gms rate_state slide: no peak in either motion
+redraw keep infinite rubbed aged: rings reach their snap one after the other, from the rim inwards
+slide_drop: the rim slides before the middle: the peaks do not coincide
peak_lost
-coulomb dahl lugre elasto_plastic maxwell_slip gms rate_state slide: no peak from rest at this speed that
 could be lost
+redraw keep infinite rubbed aged: bristles that snap already are at all stages of their bending
+slide_drop: bristles that spin slide already, and hold no more
coin_ratio
+coulomb dahl lugre elasto_plastic maxwell_slip rate_state redraw keep infinite rubbed aged slide slide_drop:
 its presliding is short beside the way: friction is that of the limit surface
-gms: its slipping elements turn round in a time (1 / C = 10 ms), not over a way: the spin is faster
stops_at_once
+coulomb dahl lugre elasto_plastic maxwell_slip gms rate_state redraw keep infinite rubbed aged slide
 slide_drop: as long as it spins, friction against the slide is weak, and the other way round
corner_moment
+coulomb dahl lugre elasto_plastic maxwell_slip gms redraw keep infinite rubbed aged slide slide_drop: every
 cell resists with its friction, at its distance
-rate_state: cells close to the corner are slower, and slow cells have more friction
corner_holds
-coulomb: creeps in proportion to the mean moment
-dahl lugre: every cell drifts as the point does (drift_per_cycle)
+elasto_plastic: every cell stays below its break-away deflection
+maxwell_slip gms: after the first period no element slips
+redraw keep infinite rubbed aged slide slide_drop: after the first period no bristle snaps
-rate_state: it still creeps, ever slower)";

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
