/// \file What contact groups cost. Each scene runs in one field of velocities, step/SCENE_one_field/coloured/threads:N,
/// and with groups, step/SCENE/coloured/threads:N: the two cubes as two groups, before they touch (two_cubes_apart) and
/// while they press on each other (two_cubes_meet), and a heap of 64 stones with a group each (stones).
#include "step.hpp"

namespace {

using namespace scenes;

/// The two cubes, until their surfaces touch. They share nodes before that.
Scene<3> apart() {
    Scene<3> scene = two_cubes<3>();
    scene.steps = {.before = 5, .all = 50, .least = 45};
    return scene;
}

/// The two cubes, while each presses on an edge of the other.
Scene<3> meeting() {
    Scene<3> scene = two_cubes<3>();
    scene.steps = {.before = 100, .all = 100, .least = 100};
    return scene;
}

/// 64 stones in four layers, each in the hollows of the layer below, in a box that holds them. They have just come to
/// touch each other and the floor, and gravity presses them together.
Scene<3> heap() {
    constexpr double radius = 6;  // [cells]
    Scene<3> scene;
    const double h = unit_box().cell_size;
    scene.domain = {{0, 0, 0}, {9 * radius * h, 0.5, 9 * radius * h}, h};
    for (std::uint64_t s = 0; s < 64; ++s) {
        const std::uint64_t layer = s / 16, along = s / 4 % 4, across = s % 4;
        const double shift = layer % 2 == 0 ? 1 : 2;
        Matter<3> stone;
        stone.centre = firn::Vec<double, 3>{shift + 2 * double(along), 1 + std::sqrt(2.0) * double(layer),
                                            shift + 2 * double(across)} *
                       (radius * h);
        stone.samples = firn::sample_sphere<3>(stone.centre, radius * h, {.spacing = h / 2, .seed = s});
        scene.matter.push_back(std::move(stone));
    }
    scene.steps = {.before = 100, .all = 100, .least = 40};
    return scene;
}

/// Registers step/SCENE/coloured/threads:N with a contact law. With groups, every body has a group of its own.
template <class Law>
bool add_scene(const std::string& scene_name, Scene<3> (*make_scene)(), const Law& law) {
    return add_coloured(scene_name, make_scene, [law](const Scene<3>& scene, int threads) {
        auto made = make_simulation<firn::SimulationWith<3, firn::FixedCorotated<float>, Law>>(
            scene, firn::Coloured{threads}, law);
        if constexpr (Law::between_groups)
            for (std::size_t b = 0; b < scene.matter.size(); ++b) made->set_contact_group(made->bodies()[b], int(b));
        return made;
    });
}

const firn::CoulombContact law{.friction = 0.3};
const bool added[] = {
    add_scene("two_cubes_apart_one_field", apart, firn::OneField{}),
    add_scene("two_cubes_apart", apart, law),
    add_scene("two_cubes_meet_one_field", meeting, firn::OneField{}),
    add_scene("two_cubes_meet", meeting, law),
    add_scene("stones_one_field", heap, firn::OneField{}),
    add_scene("stones", heap, law),
};

}  // namespace
