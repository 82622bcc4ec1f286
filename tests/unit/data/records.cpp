/// \file A particle that goes to the store of another process keeps all that it has, its contact group as well.
#include "support/catch.hpp"
#include <firn/data/particles.hpp>
#include <firn/kernel/quadratic_b_spline.hpp>
#include <firn/material/fixed_corotated.hpp>
#include <firn/sort/partition.hpp>

#include <vector>

using namespace firn;

namespace records_tests {

TEST_CASE("a particle's record brings its contact group to a store that has had none") {
    using Store = Particles<float, 2>;
    const Domain<2> domain{{0, 0}, {1, 1}, 1.0 / 16};
    Store sender(domain), receiver(domain);
    sender.push_back({0.3, 0.4}, {1.f, 2.f}, 3.f, 4.f, {});
    sender.push_back({0.7, 0.6}, {5.f, 6.f}, 7.f, 8.f, {});
    sender.set_contact_group(1, 2);
    receiver.reserve(2);
    std::vector<std::byte> record(sender.record_bytes());
    for (std::size_t slot = 0; slot < 2; ++slot) {
        sender.write_record(slot, record.data());
        receiver.put_record(slot, record.data());
        CHECK(receiver.has_contact_groups() == (slot == 1));
    }
    for (std::size_t slot = 0; slot < 2; ++slot) {
        CHECK(receiver.id(slot) == slot);
        CHECK(receiver.contact_group(slot) == (slot == 0 ? 0 : 2));
        for (int a = 0; a < 2; ++a) {
            CHECK(receiver.position(slot)[a] == sender.position(slot)[a]);
            CHECK(receiver.velocity(slot)[a] == float(4 * slot + 1) + float(a));
        }
        CHECK(receiver.mass(slot) == float(4 * slot + 3));
    }
    // Otherwise P2G and G2P would take the copy of a block for a block outside of the domain.
    CHECK(sort_particles<QuadraticBSpline>(receiver, 1).copy_stride == copy_stride(domain));
}

}  // namespace records_tests
