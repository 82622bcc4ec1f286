/// \file firn_formats FOLDER: writes a short run of drops and cloth to FOLDER in every format, and as expected.json,
/// for check.py, which opens the files with the libraries of other programs.
#include <firn/core/json.hpp>
#include <firn/io/joined_states.hpp>
#include <firn/io/mesh_state.hpp>
#include <firn/io/obj_series.hpp>
#include <firn/io/ply_series.hpp>
#include <firn/io/splat_series.hpp>
#include <firn/io/usd_series.hpp>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <vector>

namespace {

constexpr int times = 5;
constexpr double radius = 0.01;
using State = firn::State<float>;

/// Drops that fly, stretch and turn; at each time another number of them, at first none.
State drops_at(int k) {
    State state;
    state.time = 0.125 * k;
    state.fields = {{"position", "m", 3, {}},
                    {"velocity", "m/s", 3, {}},
                    {"deformation_gradient", "1", 9, {}},
                    {"volume", "m^3", 1, {}}};
    const auto add = [&](std::size_t field, auto... values) {
        (state.fields[field].values.push_back(float(values)), ...);
    };
    for (int i = 0; i < 20 * k; ++i) {
        const double phase = 0.7 * i + state.time, c = std::cos(phase), s = std::sin(phase);
        add(0, c, 0.1 * i - 0.5 * 9.81 * state.time * state.time, s);
        add(1, -s, -9.81 * state.time, c);
        add(2, c * 1.5, -s * 0.8, 0.1, s * 1.5, c * 0.8, 0.01 * i, -0.2, 0.3, 1 + 0.1 * k);
        add(3, std::pow(0.02, 3));
        state.id.push_back(3 * i);
    }
    state.body.resize(state.id.size());
    return state;
}

/// A strip of cloth that waves and loses a triangle each time.
State cloth_at(int k) {
    firn::TriangleMesh mesh;
    constexpr int columns = 4;
    for (int i = 0; i <= columns; ++i)
        for (int j = 0; j < 2; ++j) mesh.vertices.push_back({0.25 * i, 1 + 0.1 * std::sin(i + k), 0.5 * j});
    for (int i = 0; i < columns; ++i) {
        mesh.triangles.push_back({2 * i, 2 * i + 1, 2 * i + 2});
        mesh.triangles.push_back({2 * i + 1, 2 * i + 3, 2 * i + 2});
    }
    mesh.triangles.resize(mesh.triangles.size() - std::size_t(k));
    return firn::state_of<float>(mesh, 0.125 * k);
}

void add(firn::Json& json, const State& state) {
    json.object([&] {
        json.field("time", state.time);
        json.key("id").array(state.id, [&](auto id) { json.value(id); });
        json.key("facets").array(state.facets, [&](auto corner) { json.value(corner); });
        for (const auto& field : state.fields)
            json.key(field.name.c_str()).array(field.values, [&](float value) { json.value(double(value)); });
    });
}

}  // namespace

int main(int, char** arguments) {
    const std::filesystem::path folder = arguments[1];
    {
        firn::BackgroundSeries<float, firn::PlySeries> ply(folder, "drops", {.fields = {"velocity", "volume"}});
        firn::PlySeries all(folder, "all", {.fields = {"set"}});
        firn::BackgroundSeries<float, firn::ObjSeries> obj(folder, "cloth");
        firn::BackgroundSeries<float, firn::SplatSeries> splats(
            folder, "splats", {.radius = radius, .colour = {1, 0.25, 0}, .opacity = 0.9});
        firn::BackgroundSeries<float, firn::UsdSeries> usd(folder, "run", {.primvars = {}});
        firn::BackgroundSeries<float, firn::UsdSeries> fields(folder, "fields",
                                                              {.primvars = {"deformation_gradient", "volume"}});
        for (int k = 0; k < times; ++k) {
            const State drops = drops_at(k), cloth = cloth_at(k);
            ply.write(State(drops));
            all.write(firn::joined(std::vector{drops, cloth}));
            obj.write(State(cloth));
            if (k > 0) splats.write(State(drops));
            usd.write({{"drops", drops}, {"cloth", cloth}});
            if (k > 0) fields.write({{"drops", drops}});
        }
        ply.finish();
        obj.finish();
        splats.finish();
        usd.finish();
        fields.finish();
    }
    firn::Json json;
    json.object([&] {
        json.field("radius", radius);
        const std::vector<int> all{0, 1, 2, 3, 4};
        json.key("drops").array(all, [&](int k) { add(json, drops_at(k)); });
        json.key("cloth").array(all, [&](int k) { add(json, cloth_at(k)); });
    });
    std::ofstream(folder / "expected.json") << json.text();
    return 0;
}
