/// \file A simulation chosen at run time, for Python: arrays in and out, without the interpreter's lock.
#pragma once

#include <firn/any/json.hpp>

#include "arrays.hpp"
#include "gradient.hpp"
#include "offer.hpp"
#include "samples.hpp"
#include "states.hpp"

#include <exception>
#include <mutex>
#include <optional>
#include <span>
#include <utility>
#include <variant>

namespace python {

/// A set of particles, by its number or by the name of its material.
using SetName = std::variant<std::size_t, std::string>;

inline nb::dict dict_of(const std::vector<firn::StateParameter>& parameters) {
    nb::dict dict;
    for (const auto& one : parameters)
        dict[one.name.c_str()] = one.values.size() == 1 ? nb::cast(one.values[0]) : nb::cast(one.values);
    return dict;
}

/// A simulation of two or three dimensions. Threads of Python may share it: each call waits for the one before it, and
/// does so without the interpreter's lock, which other threads then have.
class OwnSimulation {
public:
    explicit OwnSimulation(const std::string& text) : simulation_(made(text)) { listen(); }
    OwnSimulation(const OwnSimulation& other) : simulation_(other.simulation_) { listen(); }

    /// Calls f(simulation) without the interpreter's lock, and then passes warnings to Python.
    template <class F>
    auto with(const F& f) {
        struct Told {
            OwnSimulation& self;
            int exceptions = std::uncaught_exceptions();
            std::vector<std::string> warnings{};
            ~Told() noexcept(false) {  // a warning may be an exception in Python
                if (std::uncaught_exceptions() > exceptions) return;
                for (const std::string& warning : warnings)
                    if (PyErr_WarnEx(PyExc_RuntimeWarning, warning.c_str(), 1) != 0) throw nb::python_error();
            }
        } told{*this};
        const nb::gil_scoped_release unlocked;
        const std::lock_guard<std::mutex> alone(mutex_);
        struct Take {
            Told& told;
            ~Take() {  // after an error, they wait for the next call
                if (std::uncaught_exceptions() <= told.exceptions) told.warnings.swap(told.self.warnings_);
            }
        } take{told};
        return std::visit(f, simulation_);
    }
    template <class F>
    auto with_set(const SetName& set, const F& f) {
        return with([&]<int D>(firn::AnySimulation<D>& simulation) {
            const auto* const name = std::get_if<std::string>(&set);
            return f(simulation, name ? simulation.set(*name) : std::get<std::size_t>(set));
        });
    }

    /// Takes one step, shortened if it would pass the time `end` [s]. \return whether the run is there
    bool step_towards(double end) {
        return with([&]<int D>(firn::AnySimulation<D>& simulation) {
            const double left = end - simulation.time();
            if (!(left > 0)) return true;
            const double dt = fixed_time_step_ > 0 ? fixed_time_step_ : simulation.stable_time_step();
            const bool is_last = left < dt * (1 + 1e-9);
            if (is_last)
                simulation.advance(left);
            else
                simulation.step();
            return is_last;
        });
    }
    void set_fixed_time_step(double dt) {
        with([&](auto& simulation) { simulation.set_fixed_time_step(dt); });
        fixed_time_step_ = dt;
    }

    nb::object read(const SetName& set, const std::string& field, const std::optional<std::string>& type) {
        const auto name = type.value_or(precision());
        if (name == "float32" || name == "float") return read_as<float>(set, field);
        if (name == "float64" || name == "double") return read_as<double>(set, field);
        throw firn::parameter_error(firn::sentence("There is no number '", name, "' here; give float32 or float64."));
    }
    template <class T>
    void read_to(const SetName& set, const std::string& field, const Array<T>& to) {
        with_set(set, [&](auto& simulation, std::size_t k) {
            simulation.read(k, field, std::span<T>(to.data(), to.size()));
        });
    }
    template <class T>
    void write(const SetName& set, const std::string& field, const Array<const T>& from) {
        with_set(set, [&](auto& simulation, std::size_t k) {
            simulation.write(k, field, std::span<const T>(from.data(), from.size()));
        });
    }
    std::string precision() {
        return with([](auto& simulation) { return simulation.precision(); });
    }
    std::size_t remove(const SetName& set, const Array<const bool>& which) {
        return with_set(set, [&]<int D>(firn::AnySimulation<D>& simulation, std::size_t k) {
            const std::vector<std::uint32_t> ids = simulation.ids(k);
            if (which.size() != ids.size())
                throw firn::parameter_error(
                    firn::sentence("There are ", ids.size(), " particles and ", which.size(), " of true and false."));
            std::vector<char> wanted(ids.empty() ? 0 : ids.back() + std::size_t(1), 0);
            for (std::size_t i = 0; i < ids.size(); ++i) wanted[ids[i]] = which.data()[i];
            return simulation.remove_if(k, [&](const auto&, std::uint32_t id) { return wanted[id] != 0; });
        });
    }
    nb::dict totals(const SetName& set) {
        nb::dict dict;
        const auto put = [&](const auto& of) {
            dict["particles"] = of.particles;
            dict["mass"] = of.mass;
            dict["momentum"] = array_of(numbers_of(of.momentum));
            dict["angular_momentum"] = array_of(numbers_of(of.angular_momentum));
            dict["first_moment"] = array_of(numbers_of(of.first_moment));
            dict["kinetic_energy"] = of.kinetic_energy;
            dict["elastic_energy"] = of.elastic_energy;
            dict["dissipated_energy"] = of.dissipated_energy;
        };
        std::visit(put, with_set(set, [](auto& simulation, std::size_t k) {
                       return std::variant<firn::Totals<2>, firn::Totals<3>>(simulation.totals(k));
                   }));
        return dict;
    }
    nb::dict material(const SetName& set) {
        return dict_of(with_set(set, [](auto& simulation, std::size_t k) { return simulation.material(k); }));
    }
    void edit_material(const SetName& set, const nb::dict& parameters) {
        std::vector<firn::NamedNumber> numbers;
        for (const auto& [name, value] : parameters)
            numbers.push_back({nb::cast<std::string>(name), nb::cast<double>(value)});
        with_set(set, [&](auto& simulation, std::size_t k) { simulation.edit_material(k, numbers); });
    }
    nb::dict reaction(std::size_t part) {
        nb::dict dict;
        std::visit(
            [&](const auto& of) {
                dict["about"] = array_of(numbers_of(of.about));
                dict["impulse"] = array_of(numbers_of(of.impulse));
                dict["angular_impulse"] = array_of(numbers_of(of.angular_impulse));
            },
            with([&](auto& simulation) {
                return std::variant<firn::Reaction<2>, firn::Reaction<3>>(simulation.reaction(part));
            }));
        return dict;
    }
    void add_source(const SetName& set, const AnySamples& samples, double density, const Numbers& velocity,
                    std::optional<double> rate, double start, double end, double lifespan) {
        with_set(set, [&]<int D>(firn::AnySimulation<D>& simulation, std::size_t k) {
            firn::Source<D> source{.samples = of_dimension<D>(samples),
                                   .density = density,
                                   .velocity = vector_of<D>(velocity, "The velocity"),
                                   .start = start,
                                   .end = end,
                                   .lifespan = lifespan};
            source.rate = rate ? *rate : firn::norm(source.velocity) / std::pow(source.samples.volume, 1.0 / D);
            simulation.add_source(k, source);
        });
    }
    std::pair<std::size_t, std::size_t> add(const SetName& set, const AnySamples& samples, double density,
                                            const std::optional<Numbers>& velocity) {
        return with_set(set, [&]<int D>(firn::AnySimulation<D>& simulation, std::size_t k) {
            const auto v = velocity ? vector_of<D>(*velocity, "The velocity") : firn::Vec<double, D>{};
            const firn::Body body = simulation.add(k, of_dimension<D>(samples), density, v);
            return std::pair<std::size_t, std::size_t>(body.first, std::size_t(body.first) + body.count);
        });
    }
    std::string boundary_part(std::size_t part) {
        return with([&](auto& simulation) {
            firn::Json json;
            firn::detail::write(json, simulation.boundary_part(part));
            return json.text();
        });
    }
    void set_boundary_part(std::size_t part, const std::string& text) {
        with([&]<int D>(firn::AnySimulation<D>& simulation) {
            const auto json = firn::JsonValue::parse(text);
            simulation.set_boundary_part(part,
                                         firn::detail::read_boundary_part<D>(json, simulation.domain(), shapes<D>()));
        });
    }

private:
    using Any = std::variant<firn::AnySimulation<2>, firn::AnySimulation<3>>;

    template <int D>
    static const firn::Samples<D>& of_dimension(const AnySamples& samples) {
        if (const auto* mine = std::get_if<firn::Samples<D>>(&samples.samples)) return *mine;
        throw firn::parameter_error(
            firn::sentence("The simulation has ", D, " dimensions, the samples have ", 5 - D, "."));
    }
    Any made(const std::string& text) {
        const auto json = firn::JsonValue::parse(text);
        const auto* const given = json.find("dimension");
        const std::uint64_t dimension = given ? given->whole() : json.at("domain").at("upper").array().size();
        if (dimension == 2) return made<2>(json);
        if (dimension == 3) return made<3>(json);
        (given ? *given : json.at("domain").at("upper")).fail("firn simulates in 2 and 3 dimensions");
    }
    template <int D>
    static std::vector<firn::ShapeReader<D>> shapes() {
        return firn::shape_readers<D>(Offered::shapes{});
    }
    template <int D>
    Any made(const firn::JsonValue& json) {
        const auto choice = firn::read_choice<D>(json, {}, shapes<D>());
        fixed_time_step_ = choice.fixed_time_step;
        return firn::AnySimulation<D>(choice, Offered{});
    }
    void listen() {
        std::visit([&](auto& of) { of.warn() = [this](const std::string& text) { warnings_.push_back(text); }; },
                   simulation_);
    }
    template <class T>
    nb::object read_as(const SetName& set, const std::string& field) {
        std::vector<std::size_t> shape;
        std::unique_ptr<T[]> data;
        with_set(set, [&](auto& simulation, std::size_t k) {
            const int components = simulation.components(k, field);
            const std::size_t count = simulation.particles(k), size = count * std::size_t(components);
            shape = shape_of(count, components);
            data.reset(new T[size]);  // not std::make_unique, which writes zeros
            simulation.read(k, field, std::span<T>(data.get(), size));
        });
        return array_of(std::move(data), shape);
    }

    double fixed_time_step_ = 0;
    Any simulation_;
    std::mutex mutex_;
    std::vector<std::string> warnings_;
};

/// A copy of a simulation, for a run and back. \see RunAndBack
class OwnRunAndBack {
public:
    OwnRunAndBack(OwnSimulation& simulation, std::size_t memory)
        : run_(simulation.with(
              [&]<int D>(firn::AnySimulation<D>& of) { return run_and_back(std::as_const(of), memory); })) {}

    nb::dict back(double duration, const Array<const double>& by_position, const Array<const double>& by_velocity) {
        ByStart by;
        {
            const nb::gil_scoped_release unlocked;
            by = run_->back(duration, {by_position.data(), by_position.size()},
                            {by_velocity.data(), by_velocity.size()});
        }
        nb::dict dict;
        for (const ByField& field : by.fields) {
            const std::size_t count = field.numbers.size() / std::size_t(field.components);
            dict[field.name.c_str()] = array_of(field.numbers, shape_of(count, field.components));
        }
        dict["material"] = dict_of(by.material);
        dict["gravity"] = array_of(by.gravity);
        dict["boundary"] = by.boundary;
        return dict;
    }

private:
    std::unique_ptr<RunAndBack> run_;
};

}  // namespace python
