/* A tracker that stays at its start pose: a template in C, without a library.
 *
 *     cc -O2 -o frozen examples/external/frozen.c
 *     skiagraph track SET --exec ./frozen --out runs/frozen
 *
 * Your own tracker would read the paths of the silhouettes ("mask") of every frame, and answer with markers, joints or angles.
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/types.h>

/* The object that follows a key, from its opening to its closing brace; NULL if there is none. */
static char *object_after(const char *text, const char *key) {
    const char *begin = strstr(text, key);
    begin = begin ? strchr(begin, '{') : NULL;
    int depth = 0;
    for (const char *c = begin; c && *c; c++) {
        depth += (*c == '{') - (*c == '}');
        if (depth == 0) {
            size_t length = (size_t)(c - begin) + 1;
            char *copy = malloc(length + 1);
            if (copy) {
                memcpy(copy, begin, length);
                copy[length] = '\0';
            }
            return copy;
        }
    }
    return NULL;
}

int main(void) {
    char *line = NULL, *markers = NULL;
    size_t capacity = 0;
    while (getline(&line, &capacity, stdin) > 0) {
        if (strstr(line, "\"type\":\"hello\"")) {
            char *start = object_after(line, "\"start\":");
            markers = start ? object_after(start, "\"markers\":") : NULL;
            free(start);
            if (!markers) {
                fprintf(stderr, "hello has no start\n");
                return 1;
            }
            puts("{\"type\":\"ready\",\"name\":\"frozen.c\"}");
        } else if (strstr(line, "\"type\":\"frame\"")) {
            const char *frame = strstr(line, "\"frame\":");
            printf("{\"type\":\"pose\",\"frame\":%ld,\"markers\":%s}\n", frame ? atol(frame + 8) : 0, markers);
        } else if (strstr(line, "\"type\":\"end\"")) {
            break;
        }
        fflush(stdout);
    }
    free(line);
    free(markers);
    return 0;
}
