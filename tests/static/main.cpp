// The headers are tested by compiling and linking them; running the program has nothing to add.
int main() {}
