/// \file Policies of a stranger, lifted to other scalars.
#include "support/catch.hpp"
#include <firn/core/dual.hpp>
#include <firn/core/error.hpp>
#include <firn/core/pack.hpp>
#include <firn/core/parameters.hpp>

#include <string>

namespace stranger {

template <firn::scalar S>
struct Spring {
    S stiffness = S(2);
    S length = S(0.5);
    static constexpr auto parameters() {
        return std::tuple{firn::parameter{"stiffness", "N/m", &Spring::stiffness},
                          firn::parameter{"length", "m", &Spring::length}};
    }
};
template <firn::scalar S, int D>
struct Wind {
    firn::Vec<S, D> velocity{};
    static constexpr auto parameters() { return std::tuple{firn::parameter{"velocity", "m/s", &Wind::velocity}}; }
};
template <firn::scalar S>
struct Own {
    S value = S(1);
    int kind = 0;
    template <class T>
    Own<T> lifted() const {
        return {T(value), kind};
    }
};
struct Plain {
    double factor = 3;
};

}  // namespace stranger

using namespace firn;

TEST_CASE("lifting converts every listed parameter, scalars and vectors", "[core][parameters]") {
    const stranger::Spring<double> spring{7, 0.25};
    const auto lanes = lift<native_pack<float>>(spring);
    STATIC_REQUIRE(std::same_as<decltype(lanes), const stranger::Spring<native_pack<float>>>);
    CHECK(lanes.stiffness[2] == 7.0f);
    CHECK(lanes.length[3] == 0.25f);
    CHECK(lift<float>(spring).length == 0.25f);
    CHECK(lift<dual<double>>(spring).stiffness.derivative == 0);
    const auto wind = lift<native_pack<double>>(stranger::Wind<float, 3>{{1.0f, -2.0f, 0.5f}});
    CHECK(wind.velocity[1][3] == -2.0);
}

TEST_CASE("a policy may lift itself; one without a scalar is the same for all", "[core][parameters]") {
    CHECK(lift<float>(stranger::Own<double>{2.5, 4}).kind == 4);
    CHECK(lift<float>(stranger::Own<double>{2.5, 4}).value == 2.5f);
    CHECK(lift<native_pack<float>>(stranger::Plain{5}).factor == 5);
}

TEST_CASE("parameters have names and units", "[core][parameters]") {
    constexpr auto listed = stranger::Spring<float>::parameters();
    CHECK(std::string(std::get<0>(listed).name) == "stiffness");
    CHECK(std::string(std::get<1>(listed).unit) == "m");
}

TEST_CASE("errors are of one family and carry their sentence", "[core][error]") {
    const auto text = sentence("dt = ", 0.125, " s, at ", 3, ".");
    CHECK(text == "dt = 0.125 s, at 3.");
    CHECK_THROWS_AS(throw parameter_error(text), error);
    CHECK_THROWS_AS(throw particle_error(text), error);
    CHECK_THROWS_AS(throw overflow_error(text), error);
    CHECK_THROWS_AS(throw mesh_error(text), error);
    CHECK_THROWS_AS(throw io_error(text), std::runtime_error);
}
