/// \file No contact between groups: all matter shares one field of velocities.
#pragma once

#include <firn/contact/concept.hpp>

namespace firn::inline FIRN_BUILD {

/// The default: all matter shares one field of velocities. Bodies that touch stick together, a cell before their
/// surfaces meet; they part again about a cell apart. \see CoulombContact
struct OneField {
    static constexpr const char* name = "one_field";
    static constexpr bool between_groups = false;  ///< There are no contact groups.
};

static_assert(contact_law<OneField>);

}  // namespace firn::inline FIRN_BUILD
