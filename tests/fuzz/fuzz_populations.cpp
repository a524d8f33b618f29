
#include "brushes.hpp"
#include "targets.hpp"

namespace fuzz {
namespace {

/// Number of representatives of the patch that is compared with the infinite brush. Both follow one path, in
/// steps so small that few bristles snap twice in a step.
constexpr std::uint32_t bristles = 8000;
/// Returns the tolerance, as a share of the force limit: more than six standard deviations of the bristles in
/// contact (1 % in sliding under the whole load, for the widest law here), plus the error of the infinite
/// brush.
double tolerance_under(double load) { return 0.065 / std::sqrt(load); }

}  // namespace

void populations(Bytes bytes) {
  using bristle::SnapLength;
  static bristle::PatchBatch batch;
  static const SnapLength laws[] = {SnapLength::lognormal(1e-5, 0.15), SnapLength::uniform(5e-6, 15e-6),
                                    SnapLength::lognormal(1e-5, 0.4)};
  Input input(bytes);
  bristle::Material m;
  m.snap_length = laws[input.choice(3)];
  m.residual_length = input.choice(2) * 1.1111e-6;
  m.shared_renewal = input.choice(2);
  const auto options = bristle::PatchOptions{}.with_outputs(bristle::Outputs::all).with_seed(input.byte());
  const bristle::PatchId ids[] = {
      batch.add(m, bristle::PatchOptions(options).with_bristles(bristles)),
      batch.add(m, bristle::PatchOptions(options).with_population(bristle::Population::infinite))};
  double load = 1.0;
  double dissipated[2] = {0.0, 0.0};
  double moved = 0.0;
  for (int leg = 0; leg < 6 && !input.empty(); ++leg) {
    const double x = input.between(-3.0, 3.0), y = input.between(-3.0, 3.0);
    // Changes the load rarely, as bristles leave when it falls and enter straight when it rises; never to 0.
    if (input.choice(4) == 3) load = input.between(0.3, 1.0);
    const int steps = 1 + static_cast<int>(std::sqrt(x * x + y * y) / 0.1);
    bristle::Response r[2];
    for (int k = 0; k < steps; ++k) {
      bristle::Motion motions[2];
      for (int i = 0; i < 2; ++i) {
        motions[i].id = ids[i];
        motions[i].normal_load = load;
        motions[i].displacement[0] = x / steps * 1e-5;
        motions[i].displacement[1] = y / steps * 1e-5;
      }
      batch.step(1e-3, motions, r);
      for (int i = 0; i < 2; ++i) dissipated[i] += r[i].dissipated + r[i].contact_loss;
    }
    moved += std::sqrt(x * x + y * y) * 1e-5;
    const double tolerance = tolerance_under(load);
    for (int axis = 0; axis < 2; ++axis)
      check(std::fabs(r[0].elastic[axis] - r[1].elastic[axis]) <= tolerance * r[1].force_limit,
            "many bristles and infinitely many pull alike");
    check(std::fabs(dissipated[0] - dissipated[1]) <= tolerance * r[1].force_limit / load * (moved + 1e-5),
          "many bristles and infinitely many lose the same energy");
    const double stored[] = {batch.stored_energy(ids[0]), batch.stored_energy(ids[1])};
    check(std::fabs(stored[0] - stored[1]) <= tolerance * r[1].force_limit * 1e-5,
          "many bristles and infinitely many store the same energy");
  }
  for (const bristle::PatchId id : ids) batch.remove(id);
  batch.patch_count();
}

}  // namespace fuzz
