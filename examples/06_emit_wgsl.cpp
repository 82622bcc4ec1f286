/// \file Writes WGSL programs for a GPU from firn's policies, which are the same definitions that run on the CPU.
///
///     06_emit_wgsl --list
///     06_emit_wgsl --dimension 3 --transfer apic --material soft_tissue --output program
///     06_emit_wgsl --all programs
#include "support/errors.hpp"
#include <firn/boundary/collider.hpp>
#include <firn/boundary/shapes.hpp>
#include <firn/boundary/together.hpp>
#include <firn/boundary/walls.hpp>
#include <firn/data/mesh_distance.hpp>
#include <firn/field/attraction.hpp>
#include <firn/force/mls.hpp>
#include <firn/force/weight_gradient.hpp>
#include <firn/io/obj.hpp>
#include <firn/kernel/cubic_b_spline.hpp>
#include <firn/kernel/linear.hpp>
#include <firn/kernel/quadratic_b_spline.hpp>
#include <firn/material/fixed_corotated.hpp>
#include <firn/material/fluid.hpp>
#include <firn/material/hencky.hpp>
#include <firn/material/modified_cam_clay.hpp>
#include <firn/material/nacc.hpp>
#include <firn/material/neo_hookean.hpp>
#include <firn/material/per_particle.hpp>
#include <firn/material/sand.hpp>
#include <firn/material/snow.hpp>
#include <firn/material/von_mises.hpp>
#include <firn/transfer/apic.hpp>
#include <firn/transfer/pic.hpp>
#include <firn/wgsl/program.hpp>

#include "own_material.hpp"
#include <CLI/CLI.hpp>

#include <filesystem>
#include <fstream>
#include <iostream>

namespace {

using firn::wgsl::Program;

/// A choice of policies, and a function that makes its program.
struct Combination {
    std::string dimension, kernel, transfer, force, material, boundary, field;
    std::function<Program()> make;

    [[nodiscard]] std::string name() const {
        return dimension + "d_" + kernel + '_' + transfer + '_' + force + '_' + material + '_' + boundary + '_' + field;
    }
};

struct Contact {
    const char* name;
    firn::Contact contact;
};
constexpr Contact contacts[] = {{"walls_separate", firn::Contact::separate},
                                {"walls_slip", firn::Contact::slip},
                                {"walls_stick", firn::Contact::stick}};

template <class... T>
struct List {};

template <class L>
struct first;
template <class T, class... Others>
struct first<List<T, Others...>> {
    using type = T;
};
template <class L>
using First = typename first<L>::type;

/// Calls f with every type of the list.
template <class... T, class F>
void for_each(List<T...>, const F& f) {
    (f(std::type_identity<T>{}), ...);
}

// Add a new policy here.
using Kernels = List<firn::QuadraticBSpline, firn::Linear, firn::CubicBSpline>;
using Transfers = List<firn::Apic, firn::Pic>;
using Forces = List<firn::MlsForce, firn::WeightGradientForce>;
using Materials = List<firn::FixedCorotated<float>, firn::NeoHookean<float>, firn::Hencky<float>, firn::Snow<float>,
                       firn::Sand<float>, firn::Fluid<float>, firn::VonMises<float>, firn::Nacc<float>,
                       firn::ModifiedCamClay<float>, SoftTissue<float>>;
/// Snow whose strength varies from particle to particle.
using VariedSnow = firn::PerParticle<firn::Snow<float>, "mu", "lambda", "lowest_stretch", "highest_stretch">;
template <int D>
using Fields = List<firn::Gravity<float, D>, firn::Attraction<float, D>>;

/// The linear kernel cannot be combined with MLS forces. Kernels after the first have one scheme each, so that this
/// program compiles quickly.
template <class Kernel, class Transfer, class Force>
constexpr bool is_offered = std::same_as<Kernel, First<Kernels>> ||
                            (std::same_as<Transfer, firn::Apic> && std::same_as<Force, firn::WeightGradientForce>);

/// The walls of the unit box; a host can move them.
template <int D>
firn::Walls<float, D> walls(firn::Contact contact, double friction) {
    return firn::Walls<float, D>::all(firn::Vec<float, D>::zero(), firn::Vec<float, D>::filled(1), {contact, friction});
}

template <class Kernel, class Transfer, class Force, class Material, class Field, int D>
Combination combination(const Contact& contact, const double& friction) {
    const auto make = [contact, &friction] {
        const auto box = walls<D>(contact.contact, friction);
        Field field{};
        field.gravity[1] = -9.81F;
        return firn::wgsl::make_program<Kernel, Transfer, Force, D>(Material{}, box, field);
    };
    return {std::to_string(D), Kernel::name, Transfer::name, Force::name,
            Material::name,    contact.name, Field::name,    make};
}

/// A bunny that stands on the origin [m].
const firn::TriangleMesh& bunny() {
    static const firn::TriangleMesh standing = [] {
        const firn::TriangleMesh read = firn::read_obj(FIRN_EXAMPLES_DATA_DIR "/bunny.obj");
        const auto mesh = firn::fitted(read, {0.0, 0.0, 0.0}, 0.34);
        return firn::translated(mesh, {0.0, -firn::bounding_box(mesh).lower[1], 0.0});
    }();
    return standing;
}

/// The bunny as an obstacle, by the distances from its mesh.
firn::Collider<firn::DistanceGrid<float, 3>> solid_bunny() {
    static const auto distances = firn::mesh_distance(bunny(), {.spacing = 0.007});
    return {.shape = {distances}, .thickness_in_cells = 0.5, .position = {0.5, 0.0, 0.5}};
}

/// A material between rough walls, with an obstacle in its way, a collider that `obstacle` returns.
template <class Material, class Obstacle>
Combination with_obstacle(const char* boundary_name, const double& friction, const Obstacle& obstacle) {
    constexpr int D = 3;
    using Field = firn::Attraction<float, D>;
    const auto make = [&friction, obstacle] {
        auto solid = obstacle();
        solid.contact = firn::Contact::separate;
        solid.friction = std::max(friction, 0.5);
        const firn::Together boundary(walls<D>(firn::Contact::separate, solid.friction), solid);
        Field field{};
        field.gravity[1] = -9.81F;
        return firn::wgsl::make_program<First<Kernels>, First<Transfers>, First<Forces>, D>(Material{}, boundary,
                                                                                            field);
    };
    return {std::to_string(D),
            First<Kernels>::name,
            First<Transfers>::name,
            First<Forces>::name,
            Material::name,
            boundary_name,
            Field::name,
            make};
}

/// Snow with a box in its way, and water with a mesh. Of several materials on one grid only the first one's program
/// changes velocities at nodes, so others beside the water need no obstacle.
void add_obstacles(std::vector<Combination>& all, const double& friction) {
    all.push_back(with_obstacle<VariedSnow>("walls_separate_box", friction,
                                            [] { return firn::Collider<firn::Box<float, 3>>{}; }));
    all.push_back(with_obstacle<firn::Fluid<float>>("walls_separate_mesh", friction, solid_bunny));
}

/// Adds every kernel, transfer and force form with the first material, and every material with the first of each. Other
/// combinations work, too, but all of them together would take minutes to compile.
template <int D>
void add_combinations(std::vector<Combination>& all, const double& friction) {
    const auto add = [&]<class Kernel, class Transfer, class Force, class Material>(List<Kernel, Transfer, Force>,
                                                                                    std::type_identity<Material>) {
        for_each(Fields<D>{}, [&]<class Field>(std::type_identity<Field>) {
            for (const Contact& contact : contacts)
                all.push_back(combination<Kernel, Transfer, Force, Material, Field, D>(contact, friction));
        });
    };
    using FirstMaterial = First<Materials>;
    for_each(Materials{}, [&]<class Material>(std::type_identity<Material> material) {
        add(List<First<Kernels>, First<Transfers>, First<Forces>>{}, material);
    });
    for_each(Kernels{}, [&]<class Kernel>(std::type_identity<Kernel>) {
        for_each(Transfers{}, [&]<class Transfer>(std::type_identity<Transfer>) {
            for_each(Forces{}, [&]<class Force>(std::type_identity<Force>) {
                using Scheme = List<Kernel, Transfer, Force>;
                if constexpr (is_offered<Kernel, Transfer, Force> &&
                              !std::same_as<Scheme, List<First<Kernels>, First<Transfers>, First<Forces>>>)
                    add(Scheme{}, std::type_identity<FirstMaterial>{});
            });
        });
    });
}

void write_file(const std::filesystem::path& path, std::string_view text) {
    std::ofstream file(path, std::ios::binary);
    file << text;
    file.close();
    if (!file) throw firn::io_error(path.string() + " cannot be written. Does the folder exist, and is the disk full?");
}

/// Writes the bytes of numbers.
template <class T>
void write_numbers(const std::filesystem::path& path, const std::vector<T>& numbers) {
    write_file(path, {reinterpret_cast<const char*>(numbers.data()), numbers.size() * sizeof(T)});
}

/// Writes what a program with the bunny needs besides: the distances, for its buffer of that name; and for a picture
/// the positions of the vertices [m], and the vertices of each triangle.
void write_bunny(const std::filesystem::path& folder, const Program& program) {
    std::vector<float> vertices;
    for (const auto& x : bunny().vertices)
        for (int a = 0; a < 3; ++a) vertices.push_back(float(x[a]));
    write_numbers(folder / "distances.bin", program.distances.joined());
    write_numbers(folder / "vertices.bin", vertices);
    write_numbers(folder / "triangles.bin", bunny().triangles);
}

void write(const std::filesystem::path& folder, const Combination& chosen) {
    Program program = chosen.make();
    program.name = chosen.name();
    program.boundary = chosen.boundary;
    std::error_code problem;
    std::filesystem::create_directories(folder, problem);
    if (problem) throw firn::io_error("The folder " + folder.string() + " cannot be made: " + problem.message() + ".");
    write_file(folder / "program.wgsl", program.code);
    write_file(folder / "manifest.json", firn::wgsl::manifest(program));
    if (program.distances.size() > 0) write_bunny(folder, program);
}

int emit_wgsl(int argc, char** argv) {
    double friction = 0;
    std::vector<Combination> all;
    add_combinations<3>(all, friction);
    add_obstacles(all, friction);
    add_combinations<2>(all, friction);

    CLI::App app(
        "Writes WGSL programs from firn's definitions, each with a manifest that says how to run it. It has "
        "every kernel, transfer and force form with one material, every material with one of these, and two "
        "with an obstacle: a box, and a mesh, which has files of its own. A program of your own can make any other "
        "combination with firn::wgsl.",
        "emit_wgsl");
    bool list = false;
    std::string output, all_output;
    Combination wanted = all.front();
    const auto choice = [&](const char* flag, std::string Combination::* part, const char* about) {
        std::vector<std::string> names;
        for (const Combination& c : all)
            if (std::find(names.begin(), names.end(), c.*part) == names.end()) names.push_back(c.*part);
        app.add_option(flag, wanted.*part, about)->check(CLI::IsMember(names))->capture_default_str();
    };
    app.add_flag("--list", list, "Print the programs that this can write and exit");
    choice("--dimension", &Combination::dimension, "Dimension of space");
    choice("--kernel", &Combination::kernel, "Interpolation kernel");
    choice("--transfer", &Combination::transfer, "Transfer scheme");
    choice("--force", &Combination::force, "Force form");
    choice("--material", &Combination::material, "Constitutive model");
    choice("--boundary", &Combination::boundary, "Walls of the box");
    choice("--field", &Combination::field, "Acceleration field");
    app.add_option("--friction", friction, "Coulomb friction of the walls; at least 0.5 with an obstacle")
        ->check(CLI::NonNegativeNumber)
        ->capture_default_str();
    CLI::Option* one =
        app.add_option("--output", output, "Folder for program.wgsl, manifest.json and a mesh")->type_name("DIR");
    app.add_option("--all", all_output, "Write all that --list prints, each to its own folder in DIR")
        ->type_name("DIR")
        ->excludes(one);
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& problem) {
        const int code = app.exit(problem);
        return problem.get_exit_code() == 0 ? 0 : std::max(code, 1);
    }

    if (list) {
        for (const Combination& c : all)
            std::cout << c.dimension << ' ' << c.kernel << ' ' << c.transfer << ' ' << c.force << ' ' << c.material
                      << ' ' << c.boundary << ' ' << c.field << '\n';
        return 0;
    }
    if (!all_output.empty()) {
        for (const Combination& c : all) write(std::filesystem::path(all_output) / c.name(), c);
        std::cout << all.size() << " programs in " << all_output << '\n';
        return 0;
    }
    if (output.empty()) {
        std::cerr << "Give a folder with --output or --all, or use --list or --help.\n";
        return 1;
    }
    for (const Combination& c : all)
        if (c.name() == wanted.name()) {
            write(output, c);
            std::cout << c.name() << " in " << output << '\n';
            return 0;
        }
    throw firn::usage_error("This program does not write " + wanted.name() + "; --list prints all that it can write.");
}

}  // namespace

int main(int argc, char** argv) {
    return example::report_errors([&] { return emit_wgsl(argc, argv); });
}
