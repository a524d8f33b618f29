// Saves the state of a batch as bytes, and makes batches work with pickle and copy.
#include <memory>

#include <pybind11/stl.h>

#include "core/c_interface/field_count.hpp"
#include "core/runtime/batch_recipe.hpp"
#include "tools/products/python/batch.hpp"

namespace bristle_python {

using bristle::BatchRecipe;
using bristle::PatchOptions;
using bristle::PatchRecipe;

namespace {

constexpr int format = 3;

py::bytes state_of(Batch& self) {
  const std::size_t size = self.batch.state_size();
  py::bytes state =
      py::reinterpret_steal<py::bytes>(PyBytes_FromStringAndSize(nullptr, static_cast<py::ssize_t>(size)));
  if (!state) throw py::error_already_set();
  self.batch.save_state({reinterpret_cast<std::byte*>(PyBytes_AsString(state.ptr())), size});
  return state;
}

bool alike(const PatchOptions& a, const PatchOptions& b) {
  static_assert(bristle::detail::field_count<PatchOptions> == 13,
                "each field but seed, key and `compared` is compared");
  return a.max_normal_load == b.max_normal_load && a.bristles == b.bristles && a.axes == b.axes &&
         a.outputs == b.outputs && a.precision == b.precision && a.population == b.population &&
         a.cohorts == b.cohorts && a.resolution == b.resolution && a.fluctuation == b.fluctuation &&
         a.lay == b.lay;
}

/// Set of the distinct recipes of a batch's patches. Equal recipes may differ in slot, seed and key; a batch
/// has few distinct ones.
class Kinds {
 public:
  std::uint64_t find(const PatchRecipe& patch) {
    // Searches backwards, since patches added together are mostly alike.
    for (std::size_t k = kinds_.size(); k-- > 0;) {
      const PatchRecipe& kind = kinds_[k];
      if (kind.material == patch.material && kind.full_weight == patch.full_weight &&
          alike(kind.options, patch.options))
        return k;
      if (kinds_.size() - k == 64) break;  // storing an equal recipe twice costs less than a long search
    }
    kinds_.push_back(patch);
    return kinds_.size() - 1;
  }
  py::list list() const {
    py::list list;
    for (const PatchRecipe& kind : kinds_)
      list.append(py::make_tuple(kind.material, kind.options, kind.full_weight));
    return list;
  }

 private:
  std::vector<PatchRecipe> kinds_;
};

constexpr py::ssize_t slot_column = 0, kind_column = 1, seed_column = 2, key_column = 3, columns = 4;

template <class T>
std::vector<T> vector_of(const py::handle& object) {
  const auto array = py::cast<py::array_t<T, py::array::c_style>>(py::cast<py::array>(object));
  return {array.data(), array.data() + array.size()};
}

}  // namespace

py::bytes save_state(Batch& self) {
  const Batch::Turn turn(self);
  return state_of(self);
}

void restore_state(Batch& self, const py::bytes& state) {
  const Batch::Turn turn(self);
  self.batch.restore_state({reinterpret_cast<const std::byte*>(PyBytes_AsString(state.ptr())),
                            static_cast<std::size_t>(PyBytes_Size(state.ptr()))});
}

py::object pickled(Batch& self) {
  const Batch::Turn turn(self);
  const BatchRecipe recipe = bristle::find_recipe(self.batch);
  Kinds kinds;
  py::array_t<std::uint64_t> patches({static_cast<py::ssize_t>(recipe.patches.size()), columns});
  auto rows = patches.mutable_unchecked<2>();
  for (py::ssize_t i = 0; i < rows.shape(0); ++i) {
    const PatchRecipe& patch = recipe.patches[static_cast<std::size_t>(i)];
    rows(i, slot_column) = patch.slot;
    rows(i, kind_column) = kinds.find(patch);
    rows(i, seed_column) = patch.options.seed;
    rows(i, key_column) = patch.options.key;
  }
  const auto array = [](const std::vector<std::uint32_t>& values) {
    return py::array_t<std::uint32_t>(static_cast<py::ssize_t>(values.size()), values.data());
  };
  const ThreadsAndKernels& made_with = self.made_with();
  return py::make_tuple(format, py::make_tuple(made_with.threads, made_with.isa, made_with.servo_core),
                        recipe.materials, kinds.list(), patches, array(recipe.generations),
                        array(recipe.free_slots), state_of(self));
}

namespace {

struct Pickled {
  ThreadsAndKernels made_with;
  BatchRecipe recipe;
  py::bytes state;
};

Pickled read_state(const py::object& object) {
  const auto state = py::cast<py::tuple>(object);
  if (state.empty() || py::cast<int>(state[0]) != format)
    throw bristle::Error("PatchBatch: pickled by another version of bristle; this one reads format " +
                         std::to_string(format));
  const py::tuple made_with = state[1];
  Pickled read{
      ThreadsAndKernels{py::cast<int>(made_with[0]), py::cast<std::optional<std::string>>(made_with[1]),
                        py::cast<int>(made_with[2])},
      {},
      py::cast<py::bytes>(state[7])};
  BatchRecipe& recipe = read.recipe;
  recipe.materials = py::cast<std::vector<bristle::Material>>(state[2]);
  recipe.generations = vector_of<std::uint32_t>(state[5]);
  recipe.free_slots = vector_of<std::uint32_t>(state[6]);
  const py::list kinds = state[3];
  std::vector<PatchRecipe> of_kind;
  for (const py::handle& kind : kinds) {
    const auto fields = py::cast<py::tuple>(kind);
    of_kind.push_back({0, py::cast<std::uint32_t>(fields[0]), py::cast<PatchOptions>(fields[1]),
                       py::cast<double>(fields[2])});
  }
  const auto patches =
      py::cast<py::array_t<std::uint64_t, py::array::c_style>>(py::cast<py::array>(state[4]));
  if (patches.ndim() != 2 || patches.shape(1) != columns)
    throw bristle::Error("PatchBatch: these are not the patches of a batch");
  const auto rows = patches.unchecked<2>();
  for (py::ssize_t i = 0; i < rows.shape(0); ++i) {
    if (rows(i, kind_column) >= of_kind.size())
      throw bristle::Error("PatchBatch: these are not the patches of a batch");
    PatchRecipe patch = of_kind[rows(i, kind_column)];
    patch.slot = static_cast<std::uint32_t>(rows(i, slot_column));
    patch.options.seed = static_cast<std::uint32_t>(rows(i, seed_column));
    patch.options.key = rows(i, key_column);
    recipe.patches.push_back(patch);
  }
  return read;
}

}  // namespace

std::unique_ptr<Batch> unpickled(const py::object& state) {
  const Pickled read = read_pickle("PatchBatch", [&] { return read_state(state); });
  auto self = std::make_unique<Batch>(read.made_with);
  bristle::fill_batch(self->batch, read.recipe);
  restore_state(*self, read.state);
  return self;
}

}  // namespace bristle_python
