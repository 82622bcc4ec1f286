/// \file Materials and solids of one's own for the Python module. Change this file, or write one like it, and install
/// again:
///
///     pip install ./examples/python -C cmake.define.FIRN_PYTHON_OWN=own.hpp
#pragma once

#include <firn/any/offer.hpp>

#include "own_material.hpp"
#include "own_shape.hpp"

namespace own {

/// The materials that are offered besides the common ones, by their names: {"name": "soft_tissue"}.
using Materials = firn::OfferedMaterials<SoftTissue>;

/// The shapes that solids of a boundary may have besides the common ones: {"shape": "rounded_box", "rounding": 0.01}.
using Shapes = firn::OfferedShapes<RoundedBox>;

}  // namespace own
