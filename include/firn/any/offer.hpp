/// \file The types from which a program lets its user choose a simulation.
#pragma once

#include <firn/any/named_shape.hpp>
#include <firn/force/mls.hpp>
#include <firn/kernel/quadratic_b_spline.hpp>
#include <firn/material/fixed_corotated.hpp>
#include <firn/material/fluid.hpp>
#include <firn/material/modified_cam_clay.hpp>
#include <firn/material/mohr_coulomb.hpp>
#include <firn/material/nacc.hpp>
#include <firn/material/neo_hookean.hpp>
#include <firn/material/sand.hpp>
#include <firn/material/snow.hpp>
#include <firn/material/von_mises.hpp>
#include <firn/transfer/aflip.hpp>
#include <firn/transfer/apic.hpp>

#include <type_traits>

namespace firn::inline FIRN_BUILD {

/// Materials to choose from: templates of one scalar type, such as Sand. For a wrapper, give an alias template:
/// `template <class S> using Dense = PlasticVolume<MohrCoulomb<S>>;`.
template <template <class> class... M>
struct OfferedMaterials {};

/// Transfers to choose from: `OfferedTransfers<Apic, Flip<>>`.
template <class... T>
struct OfferedTransfers {};

/// Kernels to choose from.
template <class... K>
struct OfferedKernels {};

/// Force forms to choose from.
template <class... F>
struct OfferedForces {};

/// Precisions to choose from: float, double or both.
template <class... S>
struct OfferedPrecisions {};

/// The materials that a program offers unless it says otherwise.
using CommonMaterials =
    OfferedMaterials<FixedCorotated, NeoHookean, VonMises, Fluid, Sand, Snow, Nacc, MohrCoulomb, ModifiedCamClay>;

/// The types from which a simulation is chosen at run time: each precision, transfer, kernel and force form with all of
/// the materials. A type that is not in the lists is not compiled and cannot be chosen.
///
/// A precision in a dimension takes about half a minute to compile, and each material with a transfer, kernel and force
/// form two or three seconds more. \see FIRN_COMPILE_OFFER
template <class Materials = CommonMaterials, class Transfers = OfferedTransfers<Apic, Aflip<>>,
          class Precisions = OfferedPrecisions<float, double>, class Kernels = OfferedKernels<QuadraticBSpline>,
          class Forces = OfferedForces<MlsForce>, class Shapes = OfferedShapes<>>
struct Offer {
    using precisions = Precisions;  ///< the precisions
    using materials = Materials;    ///< the materials
    using transfers = Transfers;    ///< the transfers
    using kernels = Kernels;        ///< the kernels
    using forces = Forces;          ///< the force forms
    using shapes = Shapes;          ///< the program's own shapes of solids, besides those of BoundaryPart
};

}  // namespace firn::inline FIRN_BUILD
