/// \file The compiled core of the Python module.
#include <firn/version.hpp>

#include "simulation.hpp"

#include <cmath>
#include <limits>

namespace python {

namespace {

using namespace nb::literals;

/// Makes a class of Python for each exception of firn, with its sentence as the message.
void bind_errors(nb::module_& module) {
    const nb::exception<firn::error> error(module, "Error", PyExc_RuntimeError);
    const nb::exception<firn::parameter_error> parameter(module, "ParameterError",
                                                         nb::make_tuple(error, nb::borrow(PyExc_ValueError)));
    nb::exception<firn::memory_error>(module, "MemoryError", parameter);
    nb::exception<firn::particle_error>(module, "ParticleError", error);
    nb::exception<firn::overflow_error>(module, "OverflowError", error);
    nb::exception<firn::convergence_error>(module, "ConvergenceError", error);
    nb::exception<firn::mesh_error>(module, "MeshError", error);
    nb::exception<firn::io_error>(module, "IoError", error);
    nb::exception<firn::device_error>(module, "DeviceError", error);
    nb::exception<firn::usage_error>(module, "UsageError", error);
}

nb::object range(std::size_t first, std::size_t end) { return nb::handle((PyObject*)&PyRange_Type)(first, end); }

firn::Restart restart_of(const std::string& how) {
    if (how == "same_bits") return firn::Restart::same_bits;
    if (how == "other_build") return firn::Restart::other_build;
    if (how == "converted") return firn::Restart::converted;
    throw firn::parameter_error(
        firn::sentence("There is no restart '", how, "'; there are: same_bits, other_build, converted."));
}

void bind_simulation(nb::module_& module) {
    using Self = OwnSimulation;
    constexpr double infinity = std::numeric_limits<double>::infinity();
    nb::class_<Self> type(module, "SimulationCore", "What is compiled of Simulation.");
    type.def(nb::init<const std::string&>(), "choice"_a)
        .def(nb::init<const Self&>(), "other"_a)
        .def("_choice",
             [](Self& self) {
                 return self.with([](auto& simulation) { return firn::choice_text(simulation.choice()); });
             })
        .def("_step_towards", &Self::step_towards, "end"_a)
        .def("_boundary_part", &Self::boundary_part, "part"_a)
        .def("_set_boundary_part", &Self::set_boundary_part, "part"_a, "text"_a);

    type.def_prop_ro(
            "dimension", [](Self& self) { return self.with([]<int D>(firn::AnySimulation<D>&) { return D; }); },
            "2 or 3.")
        .def_prop_ro("precision", &Self::precision, "\"float\" or \"double\".")
        .def_prop_ro(
            "time", [](Self& self) { return self.with([](auto& s) { return s.time(); }); }, "Time [s].")
        .def_prop_ro(
            "steps", [](Self& self) { return self.with([](auto& s) { return s.steps(); }); },
            "The number of steps so far.")
        .def_prop_ro(
            "last_time_step", [](Self& self) { return self.with([](auto& s) { return s.last_time_step(); }); },
            "The last time step [s].")
        .def_prop_rw(
            "gravity", [](Self& self) { return self.with([](auto& s) { return numbers_of(s.gravity()); }); },
            [](Self& self, const Numbers& gravity) {
                self.with([&]<int D>(firn::AnySimulation<D>& s) { s.gravity() = vector_of<D>(gravity, "Gravity"); });
            },
            nb::for_getter(nb::sig("def gravity(self) -> list[float]")),
            nb::for_setter(nb::sig("def gravity(self, value: collections.abc.Sequence[float], /) -> None")),
            "Gravity [m/s^2]; give the whole vector to change it.")
        .def("set_fixed_time_step", &Self::set_fixed_time_step, "dt"_a, "Sets the time step [s]; 0: the bound.")
        .def(
            "stable_time_step", [](Self& self) { return self.with([](auto& s) { return s.stable_time_step(); }); },
            "Returns the bound of the time step [s].")
        .def(
            "step", [](Self& self) { self.with([](auto& s) { s.step(); }); }, "Takes one step.")
        .def(
            "advance", [](Self& self, double duration) { self.with([&](auto& s) { s.advance(duration); }); },
            "duration"_a,
            "Takes steps until `duration` [s] has passed. The last step is shortened to end then. It does not look at "
            "Ctrl-C; run() does.");

    type.def_prop_ro(
            "materials",
            [](Self& self) {
                return self.with([](auto& s) {
                    std::vector<std::string> names;
                    for (std::size_t k = 0; k < s.sets(); ++k) names.push_back(s.material_name(k));
                    return names;
                });
            },
            "The names of the materials; each has a set of particles.")
        .def(
            "particles",
            [](Self& self, const SetName& set) {
                return self.with_set(set, [](auto& s, std::size_t k) { return s.particles(k); });
            },
            "set"_a = 0, "Returns the number of particles of a set.")
        .def(
            "add",
            [](Self& self, const SetName& set, const AnySamples& samples, double density,
               const std::optional<Numbers>& velocity) {
                const auto [first, end] = self.add(set, samples, density, velocity);
                return range(first, end);
            },
            "set"_a, "samples"_a, "density"_a, "velocity"_a = nb::none(),
            nb::sig("def add(self, set: int | str, samples: Samples, density: float, velocity: "
                    "collections.abc.Sequence[float] | None = None) -> range"),
            "Adds a body of uniform density [kg/m^3] and velocity [m/s]; returns the range of its ids.")
        .def("add_source", &Self::add_source, "set"_a, "samples"_a, "density"_a, "velocity"_a, nb::kw_only(),
             "rate"_a = nb::none(), "start"_a = 0.0, "end"_a = infinity, "lifespan"_a = infinity,
             "Adds a source, which gives the samples `rate` times a second; without a rate, as a jet without gaps.")
        .def(
            "add_sink",
            [](Self& self, const SetName& set, const Numbers& lower, const Numbers& upper) {
                self.with_set(set, [&]<int D>(firn::AnySimulation<D>& s, std::size_t k) {
                    s.add_sink(k, {vector_of<D>(lower, "lower"), vector_of<D>(upper, "upper")});
                });
            },
            "set"_a, "lower"_a, "upper"_a, "Adds a sink: a box [m] in which particles are removed.")
        .def("remove", &Self::remove, "set"_a, "which"_a,
             "Removes the particles, in the order of ids, for which the array is true; returns their number.")
        .def(
            "bodies",
            [](Self& self, const SetName& set) {
                nb::list ranges;
                for (const auto& body : self.with_set(set, [](auto& s, std::size_t k) { return s.bodies(k); }))
                    ranges.append(range(body.first, std::size_t(body.first) + body.count));
                return ranges;
            },
            "set"_a = 0, nb::sig("def bodies(self, set: int | str = 0) -> list[range]"),
            "Returns the ranges of the ids of bodies.")
        .def("totals", &Self::totals, "set"_a = 0,
             nb::sig("def totals(self, set: int | str = 0) -> dict[str, typing.Any]"),
             "Returns mass [kg], momentum [kg m/s], angular_momentum [kg m^2/s], first_moment [kg m], kinetic_energy, "
             "elastic_energy and dissipated_energy [J] of a set.")
        .def("material", &Self::material, "set"_a = 0,
             nb::sig("def material(self, set: int | str = 0) -> dict[str, float | list[float]]"),
             "Returns the parameters of the material of a set.")
        .def("edit_material", &Self::edit_material, "set"_a, "parameters"_a,
             nb::sig("def edit_material(self, set: int | str, parameters: dict[str, float]) -> None"),
             "Changes parameters of the material of a set.");

    type.def(
            "fields",
            [](Self& self, const SetName& set) {
                nb::dict units;
                units["position"] = "m";
                for (const auto& one : self.with_set(set, [](auto& s, std::size_t k) { return s.fields(k); }))
                    units[one.name] = one.unit;
                return units;
            },
            "set"_a = 0, nb::sig("def fields(self, set: int | str = 0) -> dict[str, str]"),
            "Returns the fields of the particles of a set, and their units.")
        .def(
            "ids",
            [](Self& self, const SetName& set) {
                return array_of(self.with_set(set, [](auto& s, std::size_t k) { return s.ids(k); }));
            },
            "set"_a = 0, nb::sig("def ids(self, set: int | str = 0) -> numpy.ndarray"),
            "Returns the ids of the particles, in ascending order: the order of all arrays.")
        .def("_read", &Self::read, "set"_a, "field"_a, "dtype"_a = nb::none())
        .def("_read_to", &Self::read_to<float>, "set"_a, "field"_a, "to"_a.noconvert())
        .def("_read_to", &Self::read_to<double>, "set"_a, "field"_a, "to"_a.noconvert())
        .def("_write", &Self::write<float>, "set"_a, "field"_a, "values"_a.noconvert())
        .def("_write", &Self::write<double>, "set"_a, "field"_a, "values"_a);

    type.def_prop_ro(
            "boundary_parts", [](Self& self) { return self.with([](auto& s) { return s.boundary_parts(); }); },
            "The number of parts of the boundary that was chosen.")
        .def(
            "measure_reactions", [](Self& self) { self.with([](auto& s) { s.measure_reactions(); }); },
            "Lets the following steps measure reactions.")
        .def("reaction", &Self::reaction, "part"_a,
             nb::sig("def reaction(self, part: int) -> dict[str, numpy.ndarray]"),
             "Returns what a part of the boundary exerted on matter in the last step: impulse [N s] and "
             "angular_impulse [N m s] about a point [m].");

    type.def(
            "state",
            [](Self& self, const SetName& set) {
                return self.with_set(set, [](auto& s, std::size_t k) { return OwnState{s.state(k)}; });
            },
            "set"_a = 0, "Returns the state of a set, with all that is needed to go on.")
        .def(
            "restore",
            [](Self& self, const SetName& set, const OwnState& state, const std::string& how) {
                const firn::Restart restart = restart_of(how);
                self.with_set(set, [&](auto& s, std::size_t k) { s.restore(k, state.state, restart); });
            },
            "set"_a, "state"_a, nb::kw_only(), "how"_a = "same_bits",
            "Restores a set from a state. how: \"same_bits\", \"other_build\" or \"converted\".");
}

void bind_run_and_back(nb::module_& module) {
    using Self = OwnRunAndBack;
    nb::class_<Self>(module, "RunAndBack", "What is compiled of gradient().")
        .def(nb::init<OwnSimulation&, std::size_t>(), "simulation"_a, "memory"_a)
        .def("back", &Self::back, "duration"_a, "by_position"_a.noconvert(), "by_velocity"_a.noconvert(),
             nb::sig("def back(self, duration: float, by_position: numpy.ndarray, by_velocity: numpy.ndarray) -> "
                     "dict[str, typing.Any]"));
}

}  // namespace

}  // namespace python

NB_MODULE(_firn, module) {
    module.doc() = "The compiled core of firn's Python module.";
    module.attr("__version__") = firn::version();
    python::bind_errors(module);
    python::bind_samples(module);
    python::bind_states(module);
    python::bind_simulation(module);
    python::bind_run_and_back(module);
}
