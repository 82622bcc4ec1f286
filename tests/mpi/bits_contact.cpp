// ranks: 2 3 4 7
#include "mpi/scenes_contact.hpp"

using namespace scenes;

TEST_CASE("Contact between groups and with boundaries by the gap: same bits and impulses on any number of ranks",
          "[mpi]") {
    check_contact<Coloured>([](const auto& e) { return balls<2>(e, NodesBehind::mirrored, true, by_gap); }, 160);
}

TEST_CASE("A rigid body and matter on several ranks push each other with the same bits", "[mpi]") {
    check_contact<Coloured>([](const auto& e) { return balls<2>(e, NodesBehind::mirrored, true, with_rigid_ball); },
                            160);
}
