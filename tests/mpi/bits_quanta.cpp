// labels: full
// ranks: 2 3 7
// threads: 1 2
#include "mpi/bits.hpp"

using namespace scenes;

TEST_CASE("Sums in integers are the same on any number of ranks", "[mpi]") {
    check_same_bits<FixedPoint<std::int32_t, Adding::atomic>>([](const auto& e) { return two_cubes(e); }, 100);
}
