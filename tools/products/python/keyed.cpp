// Binds KeyedPatches and KeyedBeds: keys in, ids out, as numpy arrays.
#include <chrono>
#include <memory>
#include <thread>

#include "tools/products/python/batch.hpp"

namespace bristle_python {

using Beds = Owned<bristle::BedBatch>;

namespace {

/// A pool over a batch of Python, which it uses in the batch's turn.
template <class Batch, class Keys>
class Pool {
 public:
  template <class... Arguments>
  explicit Pool(Owned<Batch>& owner, const Arguments&... arguments) : owner_(owner) {
    const Turn turn(owner_);
    keys_ = std::make_unique<Keys>(owner_.batch, arguments...);
  }
  /// Waits for its turn, because removing the pool's members changes the batch.
  ~Pool() {
    while (keys_) try {
        const Turn turn(owner_);
        keys_.reset();
      } catch (const bristle::Error&) {
        const WithoutLock unlocked;
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
      }
  }
  Pool(const Pool&) = delete;
  Pool& operator=(const Pool&) = delete;

  /// Returns call(keys), made in the batch's turn.
  template <class Call>
  decltype(auto) use(const Call& call) {
    const Turn turn(owner_);
    return call(*keys_);
  }

 private:
  using Turn = typename Owned<Batch>::Turn;
  Owned<Batch>& owner_;
  std::unique_ptr<Keys> keys_;
};

}  // namespace

template <class Batch, class Keys>
inline constexpr bool is_module_class<Pool<Batch, Keys>> = true;

namespace {

template <class Batch, class Keys>
void define_pool(py::class_<Pool<Batch, Keys>>& type) {
  using Self = Pool<Batch, Keys>;
  const auto look_up = [](auto find) {
    return [find](Self& self, const Ids& keys) {
      if (keys.ndim() != 1) throw bristle::Error("keys: an array of one dimension is needed");
      Ids ids(keys.shape(0));
      self.use([&](Keys& pool) {
        for (py::ssize_t i = 0; i < keys.shape(0); ++i) ids.mutable_at(i) = (pool.*find)(keys.at(i)).value;
      });
      return ids;
    };
  };
  type.def("find_or_add", look_up(&Keys::find_or_add), py::arg("keys"),
           "The ids of contacts (uint64 keys), fresh ones for new keys. 2^64 - 1 when the pool is full: it "
           "steps with status 16 and no force.")
      .def("find", look_up(&Keys::find), py::arg("keys"),
           "The ids of contacts, 0 for unknown keys; does not count as seen.")
      .def("end_step", in_turn<Self>(&Keys::end_step),
           "Ends contacts whose keys were missing for more than keep_steps; returns their number. Call it "
           "once a step.")
      .def("remove", in_turn<Self>(&Keys::remove), py::arg("key"),
           "Ends a contact now; False if there is none.")
      .def("clear", in_turn<Self>(&Keys::clear), "Ends all contacts.")
      .def("reserve", in_turn<Self>(&Keys::reserve), py::arg("capacity"),
           "Raises the capacity; contacts stay.")
      .def_property_readonly("refused", in_turn<Self>(&Keys::refused), "How often find_or_add had no room.")
      .def("__len__", in_turn<Self>(&Keys::size));
  define_saved_state(type, "Which contact has which id, as bytes. Save the batch beside it.",
                     "After restore_state of the batch. Raises bristle.Error where it does not fit.",
                     " is not copied or pickled: save its state and that of its batch");
}

}  // namespace

void define_keyed(py::module_& module) {
  using bristle::KeyedOptions;
  using KeyedPatches = Pool<bristle::PatchBatch, bristle::KeyedPatches>;
  using KeyedBeds = Pool<bristle::BedBatch, bristle::KeyedBeds>;
  constexpr KeyedOptions usual;
  py::class_<KeyedPatches> patches(module, "KeyedPatches",
                                   "Patches of a PatchBatch by the keys of contacts, which come and go.");
  patches.def(
      py::init([](Batch& batch, const bristle::Material& material, const bristle::PatchOptions& options,
                  std::uint32_t capacity, std::uint32_t keep_steps, bool seed_from_key) {
        const KeyedOptions keyed{capacity, keep_steps, seed_from_key};
        return std::make_unique<KeyedPatches>(batch, material, options, keyed);
      }),
      py::keep_alive<1, 2>(), py::arg("batch"), py::arg("material"),
      py::arg("options") = bristle::PatchOptions{}, py::kw_only(), py::arg("capacity") = usual.capacity,
      py::arg("keep_steps") = usual.keep_steps, py::arg("seed_from_key") = usual.seed_from_key,
      "Adds `capacity` patches to the batch.");
  define_pool(patches);
  py::class_<KeyedBeds> beds(module, "KeyedBeds", "Beds of a BedBatch by the keys of contacts.");
  beds.def(py::init([](Beds& batch, const bristle::BedMaterial& material, const bristle::BedShape& shape,
                       double max_normal_load, bool all_outputs, double longest_piece, std::uint32_t capacity,
                       std::uint32_t keep_steps) {
             const bristle::BedOptions bed{max_normal_load, all_outputs, longest_piece};
             const KeyedOptions keyed = KeyedOptions{}.with_capacity(capacity).with_keep_steps(keep_steps);
             return std::make_unique<KeyedBeds>(batch, material, shape, bed, keyed);
           }),
           py::keep_alive<1, 2>(), py::arg("batch"), py::arg("material"), py::arg("shape"), py::kw_only(),
           py::arg("max_normal_load"), py::arg("all_outputs") = true,
           py::arg("longest_piece") = bristle::BedOptions{}.longest_piece,
           py::arg("capacity") = usual.capacity, py::arg("keep_steps") = usual.keep_steps,
           "Adds `capacity` beds to the batch.");
  define_pool(beds);
}

}  // namespace bristle_python
