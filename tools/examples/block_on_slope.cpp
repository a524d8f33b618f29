// Example of a block on a slope in a small physics engine that lists its contacts in every step without
// memory; friction is solved implicitly. The block holds still and is tapped; then the state is rolled back,
// the block is tapped again, and holds still. Exits with 1 when it creeps, or when the second taps end at
// another place than the first.
#include <cmath>
#include <cstdio>
#include <vector>

#include <bristle/bristle.hpp>
#include <bristle/coupling.hpp>

constexpr double dt = 1e-3, mass = 2.0, slope = 0.3, half = 0.05;  // s, kg, rad, m

// The engine's part: positions and loads of the contacts, in any order. How an engine finds the loads does
// not matter here.
struct EngineContact {
  double x, y, load;  // position from the centre of mass in the plane of the slope, m; load, N
};
std::vector<EngineContact> find_contacts(double along) {
  const double weight = mass * 9.81 * std::cos(slope) / 4, shift = along * 0.02 / (4 * half);
  return {{half, half, weight + shift},  // `along` acts 0.02 m above the feet: those in front carry more
          {-half, half, weight - shift},
          {half, -half, weight + shift},
          {-half, -half, weight - shift}};
}

// begin
struct Engine {
  bristle::PatchBatch batch;
  bristle::ContactMatcher matcher{bristle::MatcherOptions{}.with_capacity(64).with_reach(0.01)};
  bristle::KeyedPatches patches{batch, bristle::Material{}.with_bristle_damping(0.02),
                                bristle::PatchOptions{}
                                    .with_max_normal_load(20.0)
                                    .with_population(bristle::Population::infinite)
                                    .with_resolution(4),
                                bristle::KeyedOptions{}.with_capacity(64)};
  bristle::MovingBody<3> block;  // moves along x, along y, and about the normal
  double position[3] = {0.0, 0.0, 0.0};

  void step(double push) {  // push along x, N
    const double along = mass * 9.81 * std::sin(slope) + push;
    const std::vector<EngineContact> contacts = find_contacts(along);
    const std::size_t n = contacts.size();
    std::vector<bristle::ContactPoint> points(n);
    std::vector<std::uint64_t> keys(n);
    std::vector<bristle::Motion> motions(n);
    std::vector<bristle::Response> responses(n);
    std::vector<bristle::BodyContact<3>> feet(n);
    for (std::size_t i = 0; i < n; ++i) points[i] = {7 /* this pair */, {contacts[i].x, contacts[i].y, 0.0}};
    matcher.match(points, keys);
    for (std::size_t i = 0; i < n; ++i) {
      motions[i].id = patches.find_or_add(keys[i]);
      motions[i].normal_load = contacts[i].load;
      feet[i].index = i;
      feet[i].jacobian << 1, 0, -contacts[i].y, 0, 1, contacts[i].x;
    }
    const bristle::BodyVector<3> force = Eigen::Vector3d(along, 0, 0);
    bristle::predict_displacements(batch, dt, block, force, feet, motions);
    batch.step(dt, motions, responses);
    bristle::apply_end_forces(dt, block, force, feet, responses);
    patches.end_step();
    for (int a = 0; a < 3; ++a) position[a] += dt * block.velocity[a];
  }

  // Snapshot for a rollback: the states of the batch, the pool and the matcher. The engine saves its bodies
  // itself.
  std::vector<std::byte> saved[3];
  void save() {
    const auto keep = [](const auto& what, std::vector<std::byte>& bytes) {
      bytes.resize(what.state_size());
      what.save_state(bytes);
    };
    keep(batch, saved[0]);
    keep(patches, saved[1]);
    keep(matcher, saved[2]);
  }
  void restore() {
    batch.restore_state(saved[0]);
    patches.restore_state(saved[1]);
    matcher.restore_state(saved[2]);
  }
};
// end

int main() {
  Engine engine;
  engine.block.mass.diagonal() << mass, mass, mass * half * half;
  const auto report = [&](const char* what, double from) {
    std::printf("%-28s at %10.4f um, moved %.3g um/s\n", what, 1e6 * engine.position[0],
                1e6 * (engine.position[0] - from));
    return std::abs(engine.position[0] - from);
  };
  const auto run = [&](int steps, double tap) {
    for (int k = 0; k < steps; ++k) engine.step(k % 100 < 5 ? tap : 0.0);
  };
  run(1000, 0.0);
  report("put down, a second ago", 0.0);
  double before = engine.position[0];
  run(1000, 0.0);
  const double creep = report("a second later", before);
  before = engine.position[0];
  engine.save();
  const bristle::BodyVector<3> velocity = engine.block.velocity;
  const auto tap = [&] {
    run(1000, 1.5 /* N, of 5.8 */);
    report("tapped ten times", before);
    return engine.position[0];
  };
  const double after_taps = tap();
  engine.restore();
  engine.block.velocity = velocity;
  engine.position[0] = before;
  const bool same = tap() == after_taps;
  run(1000, 0.0);
  before = engine.position[0];
  run(1000, 0.0);
  const double creep_after = report("and a second later still", before);
  const bool right = same && creep < 1e-14 && creep_after < 1e-14 && std::abs(engine.position[0]) < 20e-6;
  if (!right) std::printf("not as it should be\n");
  return right ? 0 : 1;
}
