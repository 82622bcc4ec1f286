/// \file What the Python module offers: the common materials and those of one's own, by APIC and AFLIP, in float and
/// double.
#pragma once

#include <firn/any_simulation.hpp>

// FIRN_PYTHON_OWN is the name of a header that defines own::Materials. \see ../own.hpp
#ifdef FIRN_PYTHON_OWN
#include FIRN_PYTHON_OWN
#else
namespace own {
using Materials = firn::OfferedMaterials<>;
}
#endif

namespace python {

template <class, class>
struct Joined;
template <template <class> class... A, template <class> class... B>
struct Joined<firn::OfferedMaterials<A...>, firn::OfferedMaterials<B...>> {
    using type = firn::OfferedMaterials<A..., B...>;
};

using Offered = firn::Offer<Joined<firn::CommonMaterials, own::Materials>::type>;

}  // namespace python
