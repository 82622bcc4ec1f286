#include "support/catch.hpp"
#include <firn/io/state.hpp>

#include "example_state.hpp"

#include <functional>
#include <limits>

using states::example;

namespace state_tests {

using State = firn::State<float>;

TEST_CASE("A state whose parts fit is accepted, with no particle too", "[io][state]") {
    for (const int dimension : {2, 3}) {
        CHECK_NOTHROW(firn::check_state(example<float>(dimension, 0)));
        CHECK_NOTHROW(firn::check_state(example<double>(dimension, 3)));
    }
}

TEST_CASE("A state whose parts do not fit is refused with a sentence that names the part", "[io][state]") {
    struct Mistake {
        std::string named;
        std::function<void(State&)> make;
    };
    const double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
    const std::vector<Mistake> mistakes = {
        {"4 dimensions", [](State& s) { s.dimension = 4; }},
        {"time = nan", [=](State& s) { s.time = nan; }},
        {"last_time_step = inf", [=](State& s) { s.last_time_step = inf; }},
        {"last_time_step = -1", [](State& s) { s.last_time_step = -1; }},
        {"2 body numbers", [](State& s) { s.body.pop_back(); }},
        {"no field 'position'", [](State& s) { s.fields.erase(s.fields.begin()); }},
        {"'position' has 2 components", [](State& s) { s.fields[0] = {"position", "m", 2, {0, 0, 0, 0, 0, 0}}; }},
        {"'velocity' has 8 values", [](State& s) { s.fields[1].values.pop_back(); }},
        {"'mass' has 0 components", [](State& s) { s.fields[4].components = 0; }},
        {"two fields of the name 'mass'", [](State& s) { s.fields[5] = s.fields[4]; }},
        {"'a/b'", [](State& s) { s.fields[4].name = "a/b"; }},
        {"'a.b'", [](State& s) { s.fields[4].name = "a.b"; }},
        {"field is ''", [](State& s) { s.fields[4].name = ""; }},
        {"named 'id'", [](State& s) { s.fields[4].name = "id"; }},
        {"unit of 'mass' has 40000 bytes", [](State& s) { s.fields[4].unit = std::string(40000, 'm'); }},
        {"'young' has 0 values", [](State& s) { s.parameters[0].values.clear(); }},
        {"'../x'", [](State& s) { s.parameters[0].group = "../x"; }},
        {"two parameters of the name 'material/young'", [](State& s) { s.parameters[1].name = "young"; }},
        {"'kernel' has 3 bytes", [](State& s) { s.attributes[1].value = std::string("a\0b", 3); }},
        {"two attributes of the name 'kernel'", [](State& s) { s.attributes[0].name = "kernel"; }},
        {"named 'dimension'", [](State& s) { s.attributes[0].name = "dimension"; }},
    };
    for (const auto& mistake : mistakes) {
        auto state = example<float>(3, 3);
        mistake.make(state);
        const auto message = states::message<firn::parameter_error>([&] { firn::check_state(state); });
        INFO(message);
        CHECK(states::holds(message, mistake.named));
    }
}

TEST_CASE("A field that is not there is refused with the names of those that are", "[io][state]") {
    const auto state = example<float>(2, 1);
    CHECK(state.field("mass").unit == "kg");
    CHECK(state.find("colour") == nullptr);
    const auto message = states::message<firn::parameter_error>([&] { state.field("colour"); });
    CHECK(states::holds(message, "'colour'"));
    CHECK(states::holds(message, "position, velocity, C, deformation_gradient, mass, a pair"));
}

}  // namespace state_tests
