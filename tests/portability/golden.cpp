// The runs of support/golden.hpp by themselves, for a processor that this machine only imitates.
#include "support/golden.hpp"

#include <cstdio>

int main() {
    int wrong = 0;
    const auto check = [&](const char* name, std::uint64_t hash, std::uint64_t stored) {
        std::printf("%-16s %016llx, stored: %016llx\n", name, static_cast<unsigned long long>(hash),
                    static_cast<unsigned long long>(stored));
        wrong += hash != stored;
    };
    check("coloured, 3D", golden::coloured_3d(2), golden::of_coloured_3d);
    check("coloured, 2D", golden::coloured_2d(2), golden::of_coloured_2d);
    check("fixed point, 3D", golden::fixed_point_3d(2), golden::of_fixed_point_3d);
    check("points, 3D", golden::points_3d(2), golden::of_points_3d);
    return wrong;
}
