// labels: full
// ranks: 2 3 4 7
// threads: 1 2
#include "mpi/bits.hpp"

using namespace scenes;

TEST_CASE("Periodic waves in double, with the cubic kernel, have the same bits", "[mpi]") {
    const Seen many = check_same_bits<Coloured>([](const auto& e) { return waves(e); }, 200);
    CHECK(many.migrations >= 5);
}
