// Coefficients to start from, by name: the pairs of surfaces of core/guides/MATERIALS.md, which gives their
// sources, and the surfaces of the virtual room.
//
//   const auto wood = bristle::Material::from_coefficients(bristle::typical_coefficients("wood on wood"));
#pragma once

#include "bristle/export.hpp"
#include "bristle/material.hpp"
#include "bristle/span.hpp"

namespace bristle {

struct TypicalMaterial {
  const char* name;   ///< name such as "wood on wood"; lives for ever, as `about`
  const char* about;  ///< source of the numbers
  Coefficients coefficients;
};

/// Returns all pairs, in the order of the document. Friction depends on roughness, dirt and moisture, not on
/// the materials alone: measure it where it matters. Any thread may call it.
BRISTLE_API Span<const TypicalMaterial> typical_materials();

/// Returns the coefficients of this name. Throws bristle::Error, which lists the names, for any other.
BRISTLE_API Coefficients typical_coefficients(const char* name);

}  // namespace bristle
