/// \file What the sides of a scene's domain are: the contact, and what the nodes behind them do.
#pragma once

#include <firn/firn.hpp>

namespace verification {

struct Sides {
    firn::Contact contact = firn::Contact::slip;
    firn::NodesBehind nodes_behind = firn::NodesBehind::held;
};

/// "held" or "mirrored".
constexpr const char* name_of(firn::NodesBehind nodes_behind) {
    return nodes_behind == firn::NodesBehind::held ? "held" : "mirrored";
}

}  // namespace verification
