/// \file States: arrays with names and units, in memory and in files.
#pragma once

#include <firn/any_simulation.hpp>
#include <firn/io/state_digest.hpp>
#include <firn/io/states.hpp>

#include "arrays.hpp"

#include <string_view>
#include <utility>

namespace python {

/// A state of a set of particles; its arrays are views of this memory.
struct OwnState {
    firn::AnyState state;

    template <class F>
    auto with(const F& f) {
        return std::visit(f, state);
    }
    /// Returns a field, the ids or the bodies.
    static nb::object array(nb::handle self, const std::string& name) {
        return nb::cast<OwnState&>(self).with([&]<class S>(firn::State<S>& of) {
            if (name == "id") return view_of(of.id.data(), {of.id.size()}, self);
            if (name == "body") return view_of(of.body.data(), {of.body.size()}, self);
            auto& field = const_cast<firn::StateField<S>&>(of.field(name));
            return view_of(field.values.data(), shape_of(of.size(), field.components), self);
        });
    }
    std::vector<std::string> names() {
        return with([](auto& of) {
            std::vector<std::string> names;
            for (const auto& field : of.fields) names.push_back(field.name);
            names.insert(names.end(), {"id", "body"});
            return names;
        });
    }
    nb::dict units() {
        return with([](auto& of) {
            nb::dict units;
            for (const auto& field : of.fields) units[field.name.c_str()] = field.unit;
            return units;
        });
    }
    nb::dict attributes() {
        return with([](auto& of) {
            nb::dict texts;
            for (const auto& one : of.attributes) texts[one.name.c_str()] = one.value;
            return texts;
        });
    }
    nb::dict parameters() {
        return with([](auto& of) {
            nb::dict groups;
            for (const auto& one : of.parameters) {
                if (!groups.contains(one.group.c_str())) groups[one.group.c_str()] = nb::dict();
                auto group = nb::cast<nb::dict>(groups[one.group.c_str()]);
                group[one.name.c_str()] = one.values.size() == 1 ? nb::cast(one.values[0]) : nb::cast(one.values);
            }
            return groups;
        });
    }
};

/// Reads a state in the precision that it has in the file.
inline OwnState read_state(const std::filesystem::path& path) {
    try {
        return {firn::read_state<float>(path)};
    } catch (const firn::io_error& problem) {
        if (std::string_view(problem.what()).find("read_state<double>") == std::string_view::npos) throw;
    }
    return {firn::read_state<double>(path)};
}
inline void write_state(const std::filesystem::path& path, OwnState& state, int compression,
                        const std::vector<std::string>& fields) {
    state.with([&](const auto& of) {
        firn::write_state(path, of, firn::StateOptions{.compression = compression, .fields = fields});
    });
}

inline void bind_states(nb::module_& module) {
    using namespace nb::literals;
    using Unlocked = nb::call_guard<nb::gil_scoped_release>;
    nb::class_<OwnState>(
        module, "State",
        "The state of a set of particles, a mapping from the names of fields to arrays in the order of "
        "ids: dict(state) has them all. The arrays are views and may be written to.")
        .def(
            "__getitem__", [](nb::handle self, const std::string& name) { return OwnState::array(self, name); },
            nb::sig("def __getitem__(self, name: str) -> numpy.ndarray"))
        .def("keys", &OwnState::names, "Returns the names of the fields, \"id\" and \"body\".")
        .def(
            "__iter__", [](OwnState& self) { return nb::iter(nb::cast(self.names())); },
            nb::sig("def __iter__(self) -> collections.abc.Iterator[str]"))
        .def("__contains__",
             [](OwnState& self, const std::string& name) {
                 const auto names = self.names();
                 return std::find(names.begin(), names.end(), name) != names.end();
             })
        .def("__len__", [](OwnState& self) { return self.names().size(); })
        .def_prop_ro(
            "particles", [](OwnState& self) { return self.with([](auto& of) { return of.size(); }); },
            "The number of particles.")
        .def_prop_ro(
            "dimension", [](OwnState& self) { return self.with([](auto& of) { return of.dimension; }); }, "2 or 3.")
        .def_prop_ro(
            "step", [](OwnState& self) { return self.with([](auto& of) { return of.step; }); },
            "The number of steps since the start of the run.")
        .def_prop_ro(
            "time", [](OwnState& self) { return self.with([](auto& of) { return of.time; }); }, "Time [s].")
        .def_prop_ro("units", &OwnState::units, nb::sig("def units(self) -> dict[str, str]"), "The unit of each field.")
        .def_prop_ro("attributes", &OwnState::attributes, nb::sig("def attributes(self) -> dict[str, str]"),
                     "Texts that describe the run.")
        .def_prop_ro("parameters", &OwnState::parameters,
                     nb::sig("def parameters(self) -> dict[str, dict[str, float | list[float]]]"),
                     "The parameters of the run, by group and name.")
        .def(
            "digest", [](OwnState& self) { return self.with([](auto& of) { return firn::digest(of); }); }, Unlocked(),
            "Returns the digest of the state, as its file has it.");
    module.def("read_state", &read_state, "path"_a, Unlocked(), "Reads a state from a file that write_state() wrote.");
    module.def("write_state", &write_state, "path"_a, "state"_a, nb::kw_only(), "compression"_a = 0,
               "fields"_a = std::vector<std::string>{}, Unlocked(),
               "Writes a state to an HDF5 file. An old file stays whole if this fails.\n\n"
               "compression: 0, none, to 9.  fields: names to write besides the positions; all by default.");
}

}  // namespace python
