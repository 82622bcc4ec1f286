/// \file Collects the structs and functions of a WGSL module. The functions are recorded from C++ functions.
#pragma once

#include <firn/wgsl/body.hpp>
#include <firn/wgsl/recorded.hpp>

namespace firn::wgsl {

/// A list of structs and functions that becomes the text of a WGSL module.
class Module {
public:
    /// Records a C++ function, the definition, and adds it as a WGSL function, together with the structs that it needs.
    /// \tparam Arguments  types of the parameters, each with a shape
    /// \param name        name of the WGSL function
    /// \param comment     what the definition is or in which header it is; written above the WGSL function
    /// \param names       names of the parameters in WGSL
    /// \param definition  the C++ function, called once with recorded arguments; the type of its result has a shape
    /// \throws usage_error  if the definition reads a number that has no value, or its result has a number without a
    ///                      value
    template <class... Arguments, class Definition>
    void function(const std::string& name, const std::string& comment, const std::vector<std::string>& names,
                  const Definition& definition) {
        using Result = std::invoke_result_t<Definition, Arguments...>;
        Recording recording;
        std::size_t n = 0;
        std::vector<std::string> parameters;
        const auto input = [&]<class T>(std::type_identity<T>) {
            declare<T>();
            parameters.push_back(names[n] + ": " + shape<T>::type());
            T value{};
            shape<T>::visit(value, names[n++], [&](recorded& component, const std::string& text) {
                component = recorded::of(recording.graph.input(text));
            });
            return value;
        };
        // Braces guarantee that `input` is called for the first argument first.
        const std::tuple<Arguments...> arguments{input(std::type_identity<Arguments>{})...};
        Result result = std::apply(definition, arguments);
        declare<Result>();

        std::vector<int> outputs;
        for_components(result, [&](const recorded& component) { outputs.push_back(component.node); });
        for (const int output : outputs)
            if (output == nothing)
                throw usage_error("The definition of " + name + " leaves a number of its result without a value.");
        std::vector<std::string> taken = names;
        taken.push_back("params");
        const Body body(recording.graph, outputs, taken);
        functions_ += "/// " + comment + "\n" + "fn " + name + "(" + detail::joined(parameters, ", ") + ") -> " +
                      shape<Result>::type() + " {\n" + body.statements() + "    return " +
                      shape<Result>::build(result, [&](const recorded& x) { return body.text(x.node); }) + ";\n}\n\n";
    }

    /// Adds the WGSL structs that type T needs, except those that the module already has.
    template <class T>
    void declare() {
        shape<T>::declare([&](const std::string& name, const std::string& text) {
            for (const auto& [known, _] : structs_)
                if (known == name) return;
            structs_.emplace_back(name, text);
        });
    }

    /// Returns the WGSL text of the module: all structs, then all functions, in the order in which they were added.
    std::string text() const {
        std::string all;
        for (const auto& [_, text] : structs_) all += text + "\n";
        return all + functions_;
    }

private:
    std::vector<std::pair<std::string, std::string>> structs_;
    std::string functions_;
};

}  // namespace firn::wgsl
