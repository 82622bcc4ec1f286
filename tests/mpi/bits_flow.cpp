// ranks: 3
// threads: 2 1
#include "mpi/bits.hpp"

using namespace scenes;

TEST_CASE("A fountain by FLIP, with source, sink, sand and a disc that moves, has the same bits", "[mpi]") {
    const Seen many = check_same_bits<Coloured>([](const auto& e) { return fountain(e); }, 300);
    CHECK(many.migrations >= 5);
}

TEST_CASE("The fountain has the same bits between mirrored walls, whose columns lie on several ranks", "[mpi]") {
    check_same_bits<Coloured>([](const auto& e) { return fountain(e, NodesBehind::mirrored); }, 100);
}
