// Says for each speed target what bounds its time (instructions, latency, loads or bytes), and so what a
// faster version would have to change. The texts rest on counts by callgrind and llvm-mca.
#include <string_view>

#include "tools/libraries/capacity/capacity.hpp"

namespace cli {
namespace {

struct Bound {
  std::string_view target;  ///< name of a speed target, or its beginning for several
  const char* by;
};

// Bounds of the speed targets. The first entry whose name begins the name of a target applies to that target.
constexpr Bound bounds[] = {
    {"in_cache/few_snap",
     "instructions: in half of the blocks of 256 a bristle snaps, and they are rewritten whole"},
    {"in_cache/all_snap",
     "instructions: sums, comparisons and selections share two of the processor's pipes"},
    {"in_cache/redraw", "latency: the operations of sampling a length follow one another"},
    {"tick/900", "instructions: two thirds in the blocks, one in the call"},
    {"stuck/", "instructions of the call: no block is visited"},
    {"any_speed/keep",
     "instructions: beyond 4096 lengths a step is taken in double, a root and a quotient each"},
    {"any_speed/redraw/uniform", "latency: sampled lengths follow one another until a jump is exact enough"},
    {"any_speed/redraw/exponential", "instructions: a logarithm per sampled length"},
    {"any_speed/redraw/",
     "loads: sampled lengths follow one another until a jump is exact enough, each a look-up at a random "
     "index of a table, 45 cycles for 16 bristles"},
    {"hand/over_keep",
     "loads: renewals read and write bristles at random indices and look lengths up; keep does neither"},
    {"hand/", "instructions: a bend or a rising load passes over bristles once more"},
    {"plain_loop/all_snap/900",
     "instructions: half of the step is its loop, bound by two pipes, half are sums of blocks and the call"},
    {"plain_loop/", "instructions"},
    {"streaming/", "bytes: 12 of a bristle are read, 8 written where its block is rewritten"},
    {"batch/", "bytes: up to four cache lines of a patch, its bristles, motion and response"},
    {"lanes/resting", "bytes: motion, response, address and three columns of a contact"},
    {"lanes/", "instructions: sums and scales of each contact in double; the loop over its springs"},
    {"tick/lanes", "latency: a worker that sleeps begins some 30 us after the caller"},
    {"infinite/sticking", "instructions of the call: no cohort is looked at"},
    {"infinite/",
     "instructions: a path is followed piece by piece, each past all cohorts, for sixteen contacts at once"},
    {"spin/", "instructions: 78 cells, sixteen at once, each past all its cohorts"},
    {"threads/back_to_back",
     "latency: fork and join, and whole groups of 16,384 bristles to a thread; then bytes"},
    {"threads/default_material",
     "loads: bristles at random indices; and every thread passes over all renewals"},
    {"threads/paced", "latency: a worker that sleeps begins some 30 us after the caller"},
    {"tick/redraw", "latency: the operations of sampling a length follow one another"},
    {"tick/infinite", "instructions"},
    {"tick/", "bytes: more than the caches hold"},
};

}  // namespace

const char* bound_of(std::string_view target) noexcept {
  for (const Bound& bound : bounds)
    if (target.substr(0, bound.target.size()) == bound.target) return bound.by;
  return "";
}

}  // namespace cli
