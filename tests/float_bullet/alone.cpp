// alone PROBLEM.json: the scores.

void print_scores(const char* file);

int main(int, char** argv) { print_scores(argv[1]); }
