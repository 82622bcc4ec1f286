/// \file Collects the structs and functions of a WGSL module, recording the functions from definitions.
#pragma once

#include <firn/wgsl/body.hpp>
#include <firn/wgsl/recorded.hpp>

namespace firn::wgsl {

/// The structs and functions of a WGSL module.
class Module {
public:
    /// Records a definition and adds it as a function of WGSL, with the structs that it needs.
    /// \tparam Arguments  types of the parameters, each with a shape
    /// \param name        the function's name
    /// \param comment     where the definition comes from; becomes a comment in the module
    /// \param names       names of the parameters
    /// \param definition  called once with recorded arguments; the type of its result has a shape
    /// \throws usage_error  if the definition leaves a number of its result without a value, or reads a number that has
    ///                      none
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
        // Braces guarantee the order from the first argument to the last.
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

    /// Declares the structs that type T needs, each once.
    template <class T>
    void declare() {
        shape<T>::declare([&](const std::string& name, const std::string& text) {
            for (const auto& [known, _] : structs_)
                if (known == name) return;
            structs_.emplace_back(name, text);
        });
    }

    /// Returns the module: structs, then functions in the order in which they were added.
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
