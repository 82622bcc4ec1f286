/// \file Includes what soils need beside firn.hpp: their materials, pore water, ground at rest and factors of safety.
#pragma once

#include <firn/core/requirements.hpp>

#include <firn/material/modified_cam_clay.hpp>
#include <firn/material/mohr_coulomb.hpp>
#include <firn/material/plastic_volume.hpp>
#include <firn/material/softening_band.hpp>
#include <firn/material/undrained.hpp>
#include <firn/simulation/at_rest.hpp>
#include <firn/simulation/elastic_state.hpp>
#include <firn/simulation/strength_reduction.hpp>
