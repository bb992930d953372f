/* Autoregressive model of a signal by recursive least squares with forgetting, and its forecast.

   L. Ljung: System identification: theory for the user (1999), section 11.2. */

#include <string.h>

#define AR_ORDER 8
#define AR_STEPS 10

/* Packed state of Fleet.DeckForecast; all arrays begin with the latest or the nearest value. */
typedef struct {
    double covariance[AR_ORDER][AR_ORDER], weight[AR_ORDER], past[AR_ORDER];
    double forecast[AR_STEPS], pending[AR_STEPS];
} ArState;

/* Updates the model by the sample u and forecasts the next AR_STEPS samples. Without motion nothing
   is forgotten. */
static void ar_update(const double *previous, double u, double forgetting, double *next)
{
    ArState s;
    double gain[AR_ORDER], window[AR_ORDER + AR_STEPS], scale = 0, residual = u;
    memcpy(&s, previous, sizeof s);
    for (int i = 0; i < AR_ORDER; i++) {
        gain[i] = 0;
        for (int j = 0; j < AR_ORDER; j++) gain[i] += s.covariance[i][j] * s.past[j];
        residual -= s.weight[i] * s.past[i];
        scale += s.past[i] * gain[i];
    }
    double memory = scale > 1e-4 ? forgetting : 1;
    for (int i = 0; i < AR_ORDER; i++) {
        s.weight[i] += gain[i] * residual / (memory + scale);
        for (int j = 0; j < AR_ORDER; j++)
            s.covariance[i][j] =
                (s.covariance[i][j] - gain[i] * gain[j] / (memory + scale)) / memory;
    }
    memmove(s.past + 1, s.past, (AR_ORDER - 1) * sizeof *s.past);
    s.past[0] = u;
    memcpy(window + AR_STEPS, s.past, sizeof s.past);
    for (int k = 0; k < AR_STEPS; k++) {
        double *value = window + AR_STEPS - 1 - k;
        *value = 0;
        for (int i = 0; i < AR_ORDER; i++) *value += s.weight[i] * value[1 + i];
        s.forecast[k] = *value;
    }
    memmove(s.pending + 1, s.pending, (AR_STEPS - 1) * sizeof *s.pending);
    s.pending[0] = s.forecast[AR_STEPS - 1];
    memcpy(next, &s, sizeof s);
}
