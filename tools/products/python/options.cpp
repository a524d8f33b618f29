// Binds PatchOptions and Lay.
#include "tools/products/python/keyword_class.hpp"

namespace bristle_python {

using bristle::Outputs;
using bristle::PatchOptions;

void define_options(py::module_& module) {
  const Names<Outputs> outputs = {
      {"end", Outputs::end}, {"mean", Outputs::mean}, {"energy", Outputs::energy}, {"all", Outputs::all}};
  const Names<bristle::Precision> precisions = {{"single", bristle::Precision::single},
                                                {"double", bristle::Precision::double_}};
  const Names<bristle::Population> populations = {{"automatic", bristle::Population::automatic},
                                                  {"representatives", bristle::Population::representatives},
                                                  {"infinite", bristle::Population::infinite}};
  using bristle::Lay;
  KeywordClass<Lay>(module, "Lay",
                    "Direction of a surface that resists differently along and across it, and to and fro.")
      .field("angle", &Lay::angle, "rad, from the patch's x axis to the direction \"along\".")
      .field("limit_ratio", &Lay::limit_ratio, "Limit across over along; along it is the material's.")
      .field("stiffness_ratio", &Lay::stiffness_ratio, "Across over along; 0 = limit_ratio squared.")
      .field("to_over_fro", &Lay::to_over_fro,
             "Limit of motion along the direction over that against it; other than 1 for rule \"slide\".")
      .done();
  KeywordClass<PatchOptions>(
      module, "PatchOptions",
      "How a patch is simulated. What it does not ask for is neither computed nor stored.")
      .field("max_normal_load", &PatchOptions::max_normal_load,
             "N; a larger load scales the forces of all bristles.")
      .field("bristles", &PatchOptions::bristles,
             "Representatives at max load; 0 = one per bristle, at most 4096.")
      .field("axes", &PatchOptions::axes, "1 or 2 tangential directions.")
      .named_field(
          "outputs", &PatchOptions::outputs, outputs,
          "\"end\", \"mean\", \"energy\" or \"all\": what is computed beside the force at the end of a step.")
      .named_field("precision", &PatchOptions::precision, precisions, "\"single\" or \"double\".")
      .field("seed", &PatchOptions::seed, "Shifts stratified snap lengths, keys what is drawn at random.")
      .field("key", &PatchOptions::key, "The caller's own 64-bit name of the contact.")
      .named_field("population", &PatchOptions::population, populations,
                   "\"automatic\": infinite where the law allows it and no number of bristles is named; "
                   "\"representatives\"; \"infinite\": a list of cohorts, without noise.")
      .field("cohorts", &PatchOptions::cohorts, "Infinite: most cohorts, 8 to 512; 0 = automatic.")
      .field("resolution", &PatchOptions::resolution,
             "Infinite: pieces of path per mean snap length, 1 to 128; 0 = automatic (8).")
      .field("lay", &PatchOptions::lay, "Direction of the surface: a Lay.")
      .done();
}

}  // namespace bristle_python
