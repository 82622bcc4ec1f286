/// \file Includes all headers for simulations on a grid: the class Simulation, the policies, and the stages of a step.
///
/// These headers are not included; add those that you need: firn/lagrangian.hpp (particles, soft bodies and cloth
/// without a grid), firn/io/states.hpp (HDF5), firn/io/usd_series.hpp and its like (files for other programs),
/// firn/io/obj.hpp, firn/data/eigen.hpp, firn/wgsl/program.hpp (programs for a GPU), firn/adjoint.hpp (derivatives),
/// firn/core/own_threads.hpp (threads without OpenMP). Loops run on OpenMP's threads if the program is compiled with
/// OpenMP.
#pragma once

#include <firn/core/requirements.hpp>

#include <firn/boundary/boundary_list.hpp>
#include <firn/boundary/collider.hpp>
#include <firn/boundary/distance_grid.hpp>
#include <firn/boundary/gap_contact.hpp>
#include <firn/boundary/shapes.hpp>
#include <firn/boundary/together.hpp>
#include <firn/boundary/walls.hpp>
#include <firn/contact/coulomb.hpp>
#include <firn/core/config.hpp>
#include <firn/core/dual.hpp>
#include <firn/core/error.hpp>
#include <firn/core/lanes.hpp>
#include <firn/core/pack.hpp>
#include <firn/core/parameters.hpp>
#include <firn/core/scalar.hpp>
#include <firn/core/strict.hpp>
#include <firn/core/tensor.hpp>
#include <firn/data/mesh.hpp>
#include <firn/data/mesh_distance.hpp>
#include <firn/data/particles.hpp>
#include <firn/data/sampled_distance.hpp>
#include <firn/data/sampling.hpp>
#include <firn/data/sparse_grid.hpp>
#include <firn/field/attraction.hpp>
#include <firn/field/damped.hpp>
#include <firn/field/gravity.hpp>
#include <firn/force/mls.hpp>
#include <firn/force/none.hpp>
#include <firn/force/weight_gradient.hpp>
#include <firn/kernel/compact_quartic.hpp>
#include <firn/kernel/cubic_b_spline.hpp>
#include <firn/kernel/linear.hpp>
#include <firn/kernel/quadratic_b_spline.hpp>
#include <firn/loops/g2p.hpp>
#include <firn/loops/gap_contact.hpp>
#include <firn/loops/grid_update.hpp>
#include <firn/loops/p2g.hpp>
#include <firn/loops/p2g_with_velocities.hpp>
#include <firn/loops/reactions.hpp>
#include <firn/loops/transfer_passes.hpp>
#include <firn/loops/volume_filter.hpp>
#include <firn/loops/volume_passes.hpp>
#include <firn/material/dissipating.hpp>
#include <firn/material/fixed_corotated.hpp>
#include <firn/material/fluid.hpp>
#include <firn/material/hencky.hpp>
#include <firn/material/nacc.hpp>
#include <firn/material/neo_hookean.hpp>
#include <firn/material/no_stress.hpp>
#include <firn/material/per_particle.hpp>
#include <firn/material/plane_strain.hpp>
#include <firn/material/sand.hpp>
#include <firn/material/snow.hpp>
#include <firn/material/von_mises.hpp>
#include <firn/material/with.hpp>
#include <firn/math/left_stretch.hpp>
#include <firn/math/matrix_functions.hpp>
#include <firn/math/principal_axes.hpp>
#include <firn/math/rotor.hpp>
#include <firn/math/svd.hpp>
#include <firn/simulation.hpp>
#include <firn/sort/partition.hpp>
#include <firn/transfer/aflip.hpp>
#include <firn/transfer/apic.hpp>
#include <firn/transfer/flip.hpp>
#include <firn/transfer/fmpm.hpp>
#include <firn/transfer/pic.hpp>
#include <firn/version.hpp>
#include <firn/volumetric/f_bar.hpp>
#include <firn/volumetric/own_volume.hpp>
#include <firn/volumetric/volume_filter.hpp>
