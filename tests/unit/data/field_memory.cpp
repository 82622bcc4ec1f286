// The memory of a table of fields keeps every number through growing, sorting and moving together.
#include "support/catch.hpp"
#include <firn/data/field_memory.hpp>
#include <firn/lagrangian/point_masses.hpp>

#include <numeric>

using namespace firn;

namespace field_memory {

const FieldTable table{{"place", "1", FieldShape::vector, FieldRole::motion},
                       {"stress", "Pa", FieldShape::symmetric_matrix, FieldRole::stress},
                       {"mass", "kg", FieldShape::scalar, FieldRole::given}};

float number(std::size_t particle, std::size_t field, int component) {
    return float(1000 * particle + 10 * field + std::size_t(component) + 1);
}

TEST_CASE("growing keeps the numbers, and new ones are zero, for any number of workers") {
    for (const SlotOrder order : {SlotOrder::sorted, SlotOrder::by_id})
        for (const int workers : {1, 3}) {
            FieldMemory memory(table, 3, sizeof(float), order);
            memory.grow(32, workers);
            for (std::size_t f = 0; f < table.size(); ++f)
                for (std::size_t slot = 0; slot < 32; ++slot)
                    for (int k = 0; k < memory.components(f); ++k) memory.at<float>(f, slot, k) = number(slot, f, k);
            memory.grow(std::size_t(1) << 14, workers);  // shared by workers
            int wrong = 0;
            for (std::size_t f = 0; f < table.size(); ++f)
                for (std::size_t slot = 0; slot < memory.slots(); ++slot)
                    for (int k = 0; k < memory.components(f); ++k)
                        wrong += memory.at<float>(f, slot, k) != (slot < 32 ? number(slot, f, k) : 0);
            CHECK(wrong == 0);
            CHECK(memory.bytes() >= memory.bytes_for(memory.slots()));
        }
}

TEST_CASE("sorting moves every field, there and back, through the room of the widest one") {
    FieldMemory memory(table, 2, sizeof(float), SlotOrder::sorted);
    memory.grow(48, 1);
    std::vector<std::size_t> at(48);  // which particle is in a slot
    std::iota(at.begin(), at.end(), std::size_t(0));
    for (std::size_t f = 0; f < table.size(); ++f)
        for (std::size_t slot = 0; slot < 48; ++slot)
            for (int k = 0; k < memory.components(f); ++k) memory.at<float>(f, slot, k) = number(slot, f, k);
    for (std::size_t turn = 1; turn <= 5; ++turn) {
        aligned_vector<std::uint32_t> order(48);
        for (std::size_t i = 0; i < 48; ++i) order[i] = std::uint32_t((i * 5 + turn) % 48);
        std::fill_n(memory.room(), 3 * 48 * sizeof(float), std::byte(0xff));  // what lies there is lost
        memory.permute<std::uint32_t>(order, 2);
        const std::vector<std::size_t> before = at;
        for (std::size_t i = 0; i < 48; ++i) at[i] = before[order[i]];
        int wrong = 0;
        for (std::size_t f = 0; f < table.size(); ++f)
            for (std::size_t slot = 0; slot < 48; ++slot)
                for (int k = 0; k < memory.components(f); ++k)
                    wrong += memory.at<float>(f, slot, k) != number(at[slot], f, k);
        CHECK(wrong == 0);
    }
}

TEST_CASE("growing within the memory keeps the numbers, whether the room is before or behind the fields") {
    for (const int sorts : {0, 1, 2}) {
        FieldMemory memory(table, 3, sizeof(float), SlotOrder::sorted);
        memory.grow(256, 1);
        for (std::size_t f = 0; f < table.size(); ++f)
            for (std::size_t slot = 0; slot < 256; ++slot)
                for (int k = 0; k < memory.components(f); ++k) memory.at<float>(f, slot, k) = number(slot, f, k);
        std::size_t used = 256;
        for (int k = 0; k < sorts; ++k) {  // each sort leaves fewer slots, and moves the room to the other end
            used -= 96;
            aligned_vector<std::uint32_t> order(used);
            std::iota(order.begin(), order.end(), std::uint32_t(0));
            memory.permute<std::uint32_t>(order, 1);
        }
        const std::size_t bytes = memory.bytes(), slots = sorts == 0 ? 512 : 240;
        memory.grow(slots, 1);
        if (sorts > 0) CHECK(memory.bytes() == bytes);
        std::fill_n(memory.room(), 6 * slots * sizeof(float), std::byte(0xff));
        int wrong = 0;
        for (std::size_t f = 0; f < table.size(); ++f)
            for (std::size_t slot = 0; slot < slots; ++slot)
                for (int k = 0; k < memory.components(f); ++k)
                    wrong += memory.at<float>(f, slot, k) != (slot < used ? number(slot, f, k) : 0);
        CHECK(wrong == 0);
    }
}

TEST_CASE("a state's matrices lie row by row, symmetric ones whole") {
    const FieldInfo matrix{"F", "1", FieldShape::matrix, FieldRole::state};
    for (int k = 0; k < 9; ++k) CHECK(matrix.component_of(3, k) == k / 3 + 3 * (k % 3));  // kept column by column
    const int upper[] = {0, 1, 2, 1, 3, 4, 2, 4, 5};
    for (int k = 0; k < 9; ++k) CHECK(table[1].component_of(3, k) == upper[k]);
    CHECK(table[1].components(3) == 6);
    CHECK(table[1].components_in_state(3) == 9);
    CHECK(table[0].components_in_state(2) == 2);
}

TEST_CASE("points that are copied, moved or taken out have numbers of their own") {
    PointMasses<double, 2> points;
    for (int i = 0; i < 100; ++i)
        points.add({.position = {double(i), 0.5}, .mass = 1.0 + i, .group = std::uint32_t(i), .end = 10.0 * i});
    PointMasses<double, 2> copy = points;
    const std::vector<std::uint32_t> places = points.remove_if([](std::size_t i) { return i % 3 == 0; });
    CHECK(points.size() == 66);
    for (std::size_t i = 0; i < 100; ++i) {
        CHECK(copy.position[i][0] == double(i));
        if (i % 3 == 0) continue;
        const std::size_t p = places[i];
        CHECK((points.position[p][0] == double(i) && points.mass[p] == 1.0 + double(i) && points.id[p] == i));
        CHECK((points.group[p] == i && points.end[p] == 10.0 * double(i)));
    }
    PointMasses<double, 2> moved = std::move(copy);
    copy = points;
    copy.position[0] = {-1, -1};
    CHECK(points.position[0][0] == 1);
    CHECK(moved.size() == 100);
    CHECK(moved.add({}) == 100);
    CHECK(points.add({}) == 100);  // ids of those taken out are not given again
    const PointMasses<double, 2>& itself = moved;
    moved = itself;
    CHECK(moved.position[99][0] == 99);
}

}  // namespace field_memory
