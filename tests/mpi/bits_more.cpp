// labels: full
// ranks: 2 3 4 7
#include "mpi/bits.hpp"

using namespace scenes;

TEST_CASE("Four materials and a sphere that moves have the same bits, reactions included", "[mpi]") {
    const Seen many = check_same_bits<Coloured>([](const auto& e) { return four_materials(e); }, 300);
    CHECK(many.migrations >= 1);
}

TEST_CASE("FMPM, whose further passes exchange sums as well, has the same bits", "[mpi]") {
    const Seen many = check_same_bits<Coloured>([](const auto& e) { return two_discs(e); }, 300);
    CHECK(many.migrations >= 5);
}

TEST_CASE("Mirrored walls with friction have the same bits and reactions, at edges and with FMPM", "[mpi]") {
    check_same_bits<Coloured>([](const auto& e) { return four_materials(e, NodesBehind::mirrored); }, 150);
    check_same_bits<Coloured>([](const auto& e) { return two_discs(e, NodesBehind::mirrored); }, 300);
}

TEST_CASE("Sums in integers of 64 bits are the same with sources and sinks", "[mpi]") {
    check_same_bits<ColouredFixedPoint<std::int64_t>>([](const auto& e) { return fountain(e); }, 300);
}
