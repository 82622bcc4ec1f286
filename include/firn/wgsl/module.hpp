/// \file The parts of a WGSL module: structs, and functions recorded from definitions.
#pragma once

#include <firn/wgsl/body.hpp>
#include <firn/wgsl/recorded.hpp>

namespace firn::wgsl {

class Module {
public:
    /// A function of WGSL from a definition.
    /// \tparam Arguments  its parameters' types
    /// \param comment     which definition it comes from
    /// \param names       its parameters' names
    /// \param definition  called once, with inputs
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
        // Braces: from the first to the last.
        const std::tuple<Arguments...> arguments{input(std::type_identity<Arguments>{})...};
        Result result = std::apply(definition, arguments);
        declare<Result>();

        std::vector<int> outputs;
        for_components(result, [&](const recorded& component) { outputs.push_back(component.node); });
        for (const int output : outputs)
            if (output == nothing) throw usage_error("The definition of " + name + " leaves a number without a value.");
        std::vector<std::string> taken = names;
        taken.push_back("params");
        const Body body(recording.graph, outputs, taken);
        functions_ += "/// " + comment + "\n" + "fn " + name + "(" + detail::joined(parameters, ", ") + ") -> " +
                      shape<Result>::type() + " {\n" + body.statements() + "    return " +
                      shape<Result>::build(result, [&](const recorded& x) { return body.text(x.node); }) + ";\n}\n\n";
    }

    template <class T>
    void declare() {
        shape<T>::declare([&](const std::string& name, const std::string& text) {
            for (const auto& [known, _] : structs_)
                if (known == name) return;
            structs_.emplace_back(name, text);
        });
    }

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
