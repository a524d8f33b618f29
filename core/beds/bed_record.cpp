// Builds a bed from its shape, material and options: the positions, stiffnesses and pressures of its
// bristles.
#include <algorithm>
#include <string>

#include "bristle/error.hpp"
#include "core/beds/bed.hpp"
#include "core/common/check_fields.hpp"
#include "core/contacts/gauss.hpp"

namespace bristle {

BedShape BedShape::from_pressure(double half_x_m, double half_y_m, int nx, int ny,
                                 const std::function<double(double, double)>& pressure) {
  constexpr const char* where = "BedShape::from_pressure";
  detail::require_within(where, "half_x", half_x_m, 1e-12, 1e3, "m");
  detail::require_within(where, "half_y", half_y_m, 1e-12, 1e3, "m");
  detail::require_within(where, "nx", nx, 1, 1024);
  detail::require_within(where, "ny", ny, 1, 1024);
  constexpr int samples = 4;
  std::vector<BedCell> cells;
  for (int j = 0; j < ny; ++j)
    for (int i = 0; i < nx; ++i) {
      BedCell cell;
      cell.stiffness = cell.load = 0.0;
      for (int s = 0; s < samples * samples; ++s) {
        const double x = half_x_m * (2.0 * (i + (s % samples + 0.5) / samples) / nx - 1.0);
        const double y = half_y_m * (2.0 * (j + (s / samples + 0.5) / samples) / ny - 1.0);
        const double here = pressure(x, y);
        if (!(here > 0.0)) continue;
        cell.position[0] += x;
        cell.position[1] += y;
        cell.stiffness += 1.0;
        cell.load += here;
      }
      if (cell.stiffness == 0.0) continue;
      for (double& p : cell.position) p /= cell.stiffness;
      cells.push_back(cell);
    }
  if (cells.empty()) throw Error(std::string(where) + ": pressure is above 0 nowhere in the box");
  return from_list(std::move(cells));
}

namespace detail {

namespace {

constexpr const char* shape_text = "BedShape";
constexpr const char* material_text = "BedMaterial";

/// Bristle of a bed under construction. Its position is in half widths of the contact (for a bed made from a
/// list, in the larger half width).
struct Cell {
  double x = 0.0, y = 0.0;
  double area = 0.0;  ///< area of the bristle's cell, relative to the other cells
  double inner = -1.0, outer = 0.0;
  double share = 1.0;
};

std::vector<Cell> sphere_cells(int n) {
  std::vector<Cell> cells;
  for (int i = 0; i < n; ++i) {
    Cell cell;
    cell.area = 1.0;
    cell.inner = square(static_cast<double>(i) / n);
    cell.outer = square((i + 1.0) / n);
    cells.push_back(cell);
  }
  return cells;
}

/// Makes the bristles of an ellipse that does not roll, on rings. The rings lie at the Gauss points of r^2,
/// so that the weights of the rule are areas.
std::vector<Cell> ring_cells(int rings, int around) {
  Nodes nodes = legendre_nodes(rings);
  std::sort(nodes.begin(), nodes.end(), [](const Node& a, const Node& b) { return a.at < b.at; });
  std::vector<Cell> cells;
  double inner = 0.0;
  for (int ring = 0; ring < rings; ++ring) {
    const Node& node = nodes[static_cast<std::size_t>(ring)];
    const double r = square_root(0.5 * (1.0 + node.at));
    const double outer = ring + 1 == rings ? 1.0 : inner + node.weight;
    for (int k = 0; k < around; ++k) {
      const Turn turn = turn_by(pi * (2 * k + ring % 2) / around);
      Cell cell;
      cell.x = r * turn.cosine;
      cell.y = r * turn.sine;
      cell.area = node.weight;
      cell.inner = inner;
      cell.outer = outer;
      cells.push_back(cell);
    }
    inner = outer;
  }
  return cells;
}

/// Makes the bristles of a bed that rolls, in rows along the direction of rolling. Rows lie at Gauss points
/// across the contact, and the cells of a row have equal width. In an ellipse, each row is as long as the
/// chord there.
std::vector<Cell> row_cells(const BedShape& shape) {
  const bool chords = shape.kind == BedShape::Kind::ellipse;
  const int n = shape.cells[0];
  const int rows = shape.cells[1];
  Nodes nodes = legendre_nodes(rows);
  std::sort(nodes.begin(), nodes.end(), [](const Node& a, const Node& b) { return a.at < b.at; });
  if (rows == 1) nodes[0].at = 0.0;
  std::vector<Cell> cells;
  for (int j = 0; j < rows; ++j) {
    const Node& node = nodes[static_cast<std::size_t>(j)];
    const double inside = chords ? 1.0 - square(node.at) : 1.0;
    for (int i = 0; i < n; ++i) {
      Cell cell;
      cell.y = node.at;
      cell.area = node.weight * square_root(inside) / n;
      if (shape.rolls) {
        cell.inner = node.at;
        cell.outer = square_root(inside);
      } else {
        cell.x = -1.0 + (2.0 * i + 1.0) / n;
        const double u = 1.0 - square(cell.x) - 1.0 / (3.0 * square(static_cast<double>(n)));
        if (shape.pressure == BedPressure::parabolic) cell.share = u;
        if (shape.pressure == BedPressure::hertz) cell.share = square_root(u);
      }
      cells.push_back(cell);
    }
  }
  return cells;
}

/// Makes the bristles from the caller's list (BedShape::from_list). Its loads and stiffnesses are relative
/// numbers, so pressures are expressed in units of the largest.
std::vector<Cell> list_cells(const BedShape& shape, double largest) {
  double most = 0.0;
  for (const BedCell& given : shape.list) most = std::max(most, given.load / given.stiffness);
  std::vector<Cell> cells;
  for (const BedCell& given : shape.list) {
    Cell cell;
    cell.x = given.position[0] / largest;
    cell.y = given.position[1] / largest;
    cell.area = given.stiffness;
    cell.share = given.load / given.stiffness / most;
    cells.push_back(cell);
  }
  return cells;
}

/// Returns the caller's shape with those sizes filled in that follow from the material (Hertz). Checks the
/// sizes that the caller gave.
BedShape complete(const BedShape& given, const BedMaterial& material, const BedOptions& options) {
  using Kind = BedShape::Kind;
  BedShape shape = given;
  require_fields(shape_text, shape);
  const bool is_sphere = shape.kind == Kind::row && !shape.rolls;
  if (shape.kind == Kind::list) {
    require_within(shape_text, "list.size()", static_cast<double>(shape.list.size()), 1, 65536);
    if (shape.rolls || shape.growth != BedGrowth::fixed)
      throw Error("BedShape: a list neither rolls nor grows; use an ellipse or a rectangle");
    double load = 0.0;
    for (const BedCell& cell : shape.list) {
      for (int k = 0; k < 2; ++k) {
        require_within(shape_text, "list[].position", cell.position[k], -1e3, 1e3, "m");
        shape.half[k] = std::max(shape.half[k], magnitude(cell.position[k]));
      }
      require_within(shape_text, "list[].stiffness", cell.stiffness, 1e-30, 1e30);
      require_within(shape_text, "list[].load", cell.load, 0.0, 1e30);
      load += cell.load;
    }
    if (!(load > 0.0)) throw Error("BedShape: no cell of the list bears load");
    return shape;
  }
  if (material.radius != 0.0) {
    if (shape.half[0] != 0.0 || shape.half[1] != 0.0)
      throw Error("BedShape: half widths are given and the material has a radius; give one of them");
    const double cube = 0.75 * options.max_normal_load * material.radius / material.normal_modulus;
    shape.half[0] = exp(log(cube) / 3.0);
    if (shape.kind == Kind::ellipse) shape.half[1] = shape.half[0];
    require_fields(shape_text, shape);
  }
  if (shape.half[0] == 0.0)
    throw Error("BedShape: no half width; give it, or a radius to BedMaterial::with_elastic");
  if ((shape.kind == Kind::row) != (shape.half[1] == 0.0))
    refuse(shape_text, "half[1]", shape.half[1], shape.kind == Kind::row ? "0 for a row" : "above 0 m");
  const bool rings = shape.kind == Kind::ellipse && !shape.rolls;
  const int least_along = shape.rolls || is_sphere ? 2 : 1;
  require_within(shape_text, rings ? "cells[0] (rings)" : "cells[0] (along)", shape.cells[0], least_along,
                 shape.kind == Kind::row ? 65536 : 1024);
  if (shape.kind == Kind::row)
    require_within(shape_text, "cells[1] (rows) of a row", shape.cells[1], 1, 1);
  else
    require_within(shape_text, rings ? "cells[1] (around)" : "cells[1] (rows)", shape.cells[1], rings ? 3 : 1,
                   1024);
  if (is_sphere && shape.pressure != BedPressure::parabolic)
    throw Error("BedShape: a sphere's row has a parabolic profile");
  if (shape.growth == BedGrowth::square_root && !shape.rolls)
    throw Error("BedShape: only rows that roll grow with the root of the load");
  if (shape.growth == BedGrowth::cube_root && shape.kind == Kind::rectangle)
    throw Error("BedShape: a rectangle does not grow with the cube root of the load");
  return shape;
}

/// Refuses a number of the material that is 0, though others that are given need it.
void require_given(const char* name, double value) {
  if (value == 0.0) refuse(material_text, name, value, "a number above 0, which the elasticity needs");
}

/// Returns the stiffness of all bristles together along x at full load, N/m, and sets the gains of the bed.
/// Returns 0 if the material gives a presliding displacement, from which the stiffness then follows.
double stiffness_of(const BedMaterial& material, const BedShape& shape, Bed& bed) {
  using Kind = BedShape::Kind;
  const bool is_sphere = shape.kind == Kind::row && !shape.rolls;
  const bool elastic = material.shear_modulus != 0.0 || material.normal_modulus != 0.0;
  const bool kalker =
      material.flexibility[0] != 0.0 || material.flexibility[1] != 0.0 || material.flexibility[2] != 0.0;
  const bool tyre = material.slip_stiffness[0] != 0.0 || material.slip_stiffness[1] != 0.0;
  const bool presliding = material.presliding != 0.0;
  if (elastic + kalker + tyre + presliding != 1)
    throw Error("BedMaterial: " +
                std::string(elastic + kalker + tyre + presliding == 0 ? "no elasticity is"
                                                                      : "more than one elasticity is") +
                " given; give exactly one of with_elastic, with_flexibility, with_slip_stiffness, "
                "with_presliding");
  const double a = shape.half[0], b = shape.half[1];
  double area = 4.0 * a * b;
  if (shape.kind == Kind::ellipse) area = pi * a * b;
  if (elastic) {
    require_given("shear_modulus", material.shear_modulus);
    if (!is_sphere && !(shape.kind == Kind::ellipse && a == b))
      throw Error("BedMaterial: elastic moduli serve sphere_row and disc; give flexibilities");
    return 2.0 * material.shear_modulus * a;
  }
  if (kalker) {
    for (const double l : material.flexibility) require_given("flexibility", l);
    if (shape.kind == Kind::row || shape.kind == Kind::list)
      throw Error("BedMaterial: flexibilities need an area; use an ellipse or a rectangle");
    bed.gain[1] = material.flexibility[0] / material.flexibility[1];
    bed.spin_gain[0] = bed.spin_gain[1] = material.flexibility[0] / material.flexibility[2];
    return area / material.flexibility[0];
  }
  if (tyre) {
    for (const double c : material.slip_stiffness) require_given("slip_stiffness", c);
    if (!shape.rolls) throw Error("BedMaterial: a slip stiffness needs a shape that rolls");
    bed.gain[1] = bed.spin_gain[1] = material.slip_stiffness[1] / material.slip_stiffness[0];
    const double by_length = shape.kind == Kind::ellipse ? 3.0 * pi / 8.0 : 1.0;
    return by_length * material.slip_stiffness[0] / a;
  }
  return 0.0;
}

void check_material(const BedMaterial& material) {
  require_fields(material_text, material);
  require_within(material_text, "static_friction", material.static_friction, material.kinetic_friction,
                 100.0);
  if (material.radius != 0.0) require_given("normal_modulus", material.normal_modulus);
}

}  // namespace

BedMemory make_columns(std::uint32_t count) {
  const std::size_t numbers = std::size_t{count} * bed_columns;
  BedMemory columns(static_cast<float*>(::operator new[](numbers * sizeof(float), std::align_val_t{64})));
  std::fill_n(columns.get(), numbers, 0.0f);
  return columns;
}

Bed make_bed(const BedMaterial& material, const BedShape& given, const BedOptions& options,
             const BedKernels& kernels) {
  require_fields("BedOptions", options);
  check_material(material);
  const BedShape shape = complete(given, material, options);
  const bool is_sphere = shape.kind == BedShape::Kind::row && !shape.rolls;
  const bool is_list = shape.kind == BedShape::Kind::list;

  Bed bed;
  bed.stiffness = stiffness_of(material, shape, bed);
  bed.isotropic = bed.gain[1] == 1.0 && bed.spin_gain[0] == 1.0 && bed.spin_gain[1] == 1.0;
  bed.growth = shape.growth;
  bed.rolls = shape.rolls;
  bed.turns_rows = shape.rolls && shape.kind == BedShape::Kind::ellipse && shape.half[0] == shape.half[1];
  bed.has_chords = shape.rolls && shape.kind == BedShape::Kind::ellipse;
  bed.resists_spin = !is_sphere;
  bed.all_outputs = options.all_outputs;
  bed.friction = material.kinetic_friction;
  bed.static_over_kinetic = material.static_friction / material.kinetic_friction;
  bed.drops = bed.static_over_kinetic > 1.0;
  bed.full_load = options.max_normal_load;
  for (int k = 0; k < 2; ++k) bed.half[k] = shape.half[k];
  bed.length = std::max({shape.half[0], shape.half[1], 1e-12});
  bed.longest_piece = options.longest_piece * 2.0 * shape.half[0];
  const bool rings = shape.kind == BedShape::Kind::ellipse && !shape.rolls;
  // Whether pressure is a function of position that the shape gives. If not, each cell has its own
  // (Cell::share).
  const bool shaped = is_sphere || rings || shape.rolls;
  if (shaped && shape.pressure == BedPressure::parabolic) bed.profile = BedProfile::parabolic;
  if (shaped && shape.pressure == BedPressure::hertz) bed.profile = BedProfile::hertz;
  if (shape.rolls) {
    bed.cell = 2.0 / (shape.cells[0] - 1);
    bed.in_row = static_cast<std::uint32_t>(shape.cells[0]);
  }

  const std::vector<Cell> cells = is_sphere ? sphere_cells(shape.cells[0])
                                  : is_list ? list_cells(shape, bed.length)
                                  : rings   ? ring_cells(shape.cells[0], shape.cells[1])
                                            : row_cells(shape);
  bed.bristles = static_cast<std::uint32_t>(cells.size());
  bed.count = (bed.bristles + lane_count - 1) / lane_count * lane_count;
  bed.columns = make_columns(bed.count);
  double area = 0.0;
  for (const Cell& cell : cells) area += cell.area;
  // Counts only the area in contact. Of the n cells of a row, n - 1 touch at any time, because one is always
  // between leaving the contact at the rear and entering it in front.
  if (shape.rolls) area *= (shape.cells[0] - 1.0) / shape.cells[0];
  const double x_unit = is_list ? 1.0 : shape.half[0] / bed.length;
  const double y_unit = is_list ? 1.0 : shape.half[1] / bed.length;
  for (std::uint32_t i = 0; i < bed.count; ++i) {
    const Cell cell = i < bed.bristles ? cells[i] : Cell{};
    bed.at(bed_own, i) = static_cast<float>(cell.area / area);
    bed.at(bed_inner, i) = static_cast<float>(cell.inner);
    bed.at(bed_outer, i) = static_cast<float>(shape.rolls && i >= bed.bristles ? 1.0 : cell.outer);
    bed.at(bed_share, i) = shape.rolls ? 1.0f / bed.at(bed_outer, i) : static_cast<float>(cell.share);
    bed.at(bed_x, i) = static_cast<float>(cell.x * x_unit);
    bed.at(bed_y, i) = static_cast<float>(cell.y * y_unit);
    bed.at(bed_moved, i) = 1.0f;
  }

  stand_rows(bed);
  // Sets the bed's unit of deflection to the largest kinetic friction limit of a bristle at full load, in
  // metres.
  bed.deflection = 1.0;
  bed.state.size = 1.0;
  const double sum = set_positions(bed, kernels, 0.0);
  for (std::uint32_t i = 0; i < bed.count; ++i)
    bed.most_pressure = std::max(bed.most_pressure, static_cast<double>(bed.at(bed_pressure, i)));
  const double force = bed.friction * bed.full_load;
  if (bed.stiffness == 0.0) {
    bed.deflection = material.presliding / bed.static_over_kinetic;
    bed.stiffness = force * bed.most_pressure / (bed.deflection * sum);
  } else {
    bed.deflection = force * bed.most_pressure / (bed.stiffness * sum);
  }
  require_within(material_text, "deflection at which bristles slide", bed.deflection, 1e-13, 1e4, "m");
  for (int k = 0; k < 2; ++k) {
    bed.per_metre[k] = bed.gain[k] / bed.deflection;
    bed.per_radian[k] = bed.spin_gain[k] * bed.length / bed.deflection;
  }
  unbend(bed, kernels);
  return bed;
}

}  // namespace detail
}  // namespace bristle
