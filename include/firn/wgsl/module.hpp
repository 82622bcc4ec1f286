/// \file Builds the text of a WGSL module. Its functions are recorded from C++ functions, its structs are translated
/// from C++ structs.
#pragma once

#include <firn/wgsl/body.hpp>
#include <firn/wgsl/recorded.hpp>

#include <map>
#include <typeindex>

namespace firn::inline FIRN_BUILD::wgsl {

/// A list of WGSL structs and functions, which together are a WGSL module.
class Module {
public:
    /// Makes an empty module.
    /// \param arithmetic  how its functions write products, quotients, roots and sums
    explicit Module(Arithmetic arithmetic = Arithmetic::plain) : arithmetic_(arithmetic) {}

    /// Adds a WGSL function that computes the same as a C++ function, called the definition. Also adds the structs that
    /// the WGSL function needs. The definition is called once, to record its operations.
    /// \tparam Arguments  types of the definition's parameters; for each there is a specialisation of wgsl::shape
    /// \param name        name of the WGSL function
    /// \param comment     what the definition is or in which header it is; written above the WGSL function
    /// \param names       names of the WGSL function's parameters
    /// \param definition  the C++ function; there is a specialisation of wgsl::shape for the type of its result, too
    /// \throws usage_error  if the definition reads a scalar that has no value, or if a component of the definition's
    ///                      result has no value
    template <class... Arguments, class Definition>
    void function(const std::string& name, const std::string& comment, const std::vector<std::string>& names,
                  const Definition& definition) {
        using Result = std::invoke_result_t<Definition, Arguments...>;
        Recording recording;
        const struct Current {
            Module* before;
            ~Current() { recording_ = before; }
        } current{std::exchange(recording_, this)};
        [[maybe_unused]] std::size_t n = 0;
        std::vector<std::string> parameters;
        [[maybe_unused]] const auto input = [&]<class T>(std::type_identity<T>) {
            declare<T>();
            parameters.push_back(names[n] + ": " + shape<T>::type());
            T value{};
            shape<T>::visit(value, names[n++], [&](recorded& component, const std::string& text) {
                component = recorded::of(recording.graph.input(text));
            });
            return value;
        };
        // The braces guarantee that `input` is called for the first argument first, then for the second, and so on.
        const std::tuple<Arguments...> arguments{input(std::type_identity<Arguments>{})...};
        Result result = std::apply(definition, arguments);
        declare<Result>();

        std::vector<int> outputs;
        for_components(result, [&](const recorded& component) { outputs.push_back(component.node); });
        for (const int output : outputs)
            if (output == nothing)
                throw usage_error("The definition of " + name + " leaves a number of its result without a value.");
        std::vector<std::string> taken = names;
        taken.insert(taken.end(), {"params", "chosen", "distances"});
        const Body body(recording.graph, outputs, taken, arithmetic_);
        functions_ += "/// " + comment + "\n" + "fn " + name + "(" + detail::joined(parameters, ", ") + ") -> " +
                      shape<Result>::type() + " {\n" + body.statements() + "    return " +
                      shape<Result>::build(result, [&](const recorded& x) { return body.text(x.node); }) + ";\n}\n\n";
    }

    /// Adds a WGSL function that others call, unless the module has it already. The arguments are those of function().
    /// \throws usage_error  if the module has a function of this name from a definition of another type; or if
    ///                      function() throws it
    template <class... Arguments, class Definition>
    void called_function(const std::string& name, const std::string& comment, const std::vector<std::string>& names,
                         const Definition& definition) {
        const auto [known, is_new] = called_.try_emplace(name, typeid(Definition));
        if (is_new)
            function<Arguments...>(name, comment, names, definition);
        else if (known->second != typeid(Definition))
            throw usage_error("Two definitions are called as the function " + name + " of WGSL.");
    }
    /// Returns the module whose function this thread is recording; null if there is none.
    static Module* recording() { return recording_; }

    /// Adds the WGSL structs that are needed for values of type T. Structs that the module already has are not added
    /// again.
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
    Arithmetic arithmetic_;
    std::vector<std::pair<std::string, std::string>> structs_;
    std::string functions_;
    std::map<std::string, std::type_index> called_;
    static inline thread_local Module* recording_ = nullptr;
};

template <class Definition, has_shape... Arguments>
std::invoke_result_t<const Definition&, const Arguments&...> record_call(const std::string& name,
                                                                         const std::string& comment,
                                                                         const std::vector<std::string>& names,
                                                                         const Definition& definition,
                                                                         const Arguments&... arguments) {
    Module* const module = Module::recording();
    if (!module) return definition(arguments...);
    {
        const Recording::Pause pause;
        module->template called_function<Arguments...>(name, comment, names, definition);
    }
    Call call{name, {}, {}, [=](const auto& text) {
                  std::vector<std::string> all;
                  std::size_t k = 0;
                  (all.push_back(shape<Arguments>::build(arguments, [&](const recorded&) { return text(k++); })), ...);
                  return detail::joined(all, ", ");
              }};
    const auto add = [&](auto argument) {
        for_components(argument, [&](const recorded& x) {
            if (x.node == nothing) throw usage_error("A call of " + name + " gets a number that has no value yet.");
            call.arguments.push_back(x.node);
        });
    };
    (add(arguments), ...);
    std::invoke_result_t<const Definition&, const Arguments&...> result{};
    using Result = decltype(result);
    shape<Result>::visit(result, "", [&](const recorded&, const std::string& part) { call.parts.push_back(part); });
    const std::vector<int> nodes = Recording::current().call(std::move(call));
    std::size_t k = 0;
    for_components(result, [&](recorded& x) { x = recorded::of(nodes[k++]); });
    return result;
}

}  // namespace firn::inline FIRN_BUILD::wgsl
