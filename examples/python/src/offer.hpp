/// \file What the Python module offers: the common materials and shapes and those of one's own, by APIC and AFLIP, in
/// float and double.
#pragma once

#include <firn/any_simulation.hpp>

namespace nothing_own {
using Materials = firn::OfferedMaterials<>;
using Shapes = firn::OfferedShapes<>;
}  // namespace nothing_own
/// A name that the header does not define is that of nothing_own.
namespace own {
using namespace nothing_own;
}

// FIRN_PYTHON_OWN is the name of a header that defines own::Materials, own::Shapes or both. \see ../own.hpp
#ifdef FIRN_PYTHON_OWN
#include FIRN_PYTHON_OWN
#endif

namespace python {

template <class, class>
struct Joined;
template <template <class> class... A, template <class> class... B>
struct Joined<firn::OfferedMaterials<A...>, firn::OfferedMaterials<B...>> {
    using type = firn::OfferedMaterials<A..., B...>;
};

using Offered =
    firn::Offer<Joined<firn::CommonMaterials, own::Materials>::type, firn::OfferedTransfers<firn::Apic, firn::Aflip<>>,
                firn::OfferedPrecisions<float, double>, firn::OfferedKernels<firn::QuadraticBSpline>,
                firn::OfferedForces<firn::MlsForce>, own::Shapes>;

}  // namespace python
