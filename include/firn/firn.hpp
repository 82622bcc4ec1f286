/// \file All of firn that needs only Eigen (and uses OpenMP where it is enabled). States in HDF5: firn/io.
#pragma once

#include <firn/core/config.hpp>
#include <firn/core/dual.hpp>
#include <firn/core/eigen.hpp>
#include <firn/core/error.hpp>
#include <firn/core/pack.hpp>
#include <firn/core/parameters.hpp>
#include <firn/core/scalar.hpp>
#include <firn/core/strict.hpp>
#include <firn/core/tensor.hpp>
#include <firn/math/left_stretch.hpp>

#include <firn/boundary/walls.hpp>
#include <firn/force/mls.hpp>
#include <firn/force/weight_gradient.hpp>
#include <firn/kernel/quadratic_b_spline.hpp>
#include <firn/material/fixed_corotated.hpp>
#include <firn/transfer/apic.hpp>
#include <firn/transfer/pic.hpp>

#include <firn/data/mesh.hpp>
#include <firn/data/particles.hpp>
#include <firn/data/sampling.hpp>
#include <firn/data/sparse_grid.hpp>

#include <firn/exec/g2p.hpp>
#include <firn/exec/grid_update.hpp>
#include <firn/exec/p2g.hpp>
#include <firn/exec/partition.hpp>

#include <firn/simulation.hpp>
#include <firn/version.hpp>
