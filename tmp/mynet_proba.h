
#include <eml_net.h>
static const float mynet_layer_0_biases[8] = { -0.403841f, -0.454843f, -0.274927f, 0.484552f, -0.118078f, -0.169885f, -0.582541f, 0.483089f };
static const float mynet_layer_0_weights[144] = { 0.118206f, 0.027614f, -0.356603f, -0.077425f, -0.322804f, 0.034259f, -0.166062f, -0.242085f, -0.276442f, 0.043714f, -0.007151f, 0.070199f, -0.182321f, -0.018191f, -0.268878f, 0.010231f, -0.199883f, 0.185073f, -0.226188f, -0.214308f, 0.210867f, 0.622871f, 0.003524f, 0.022340f, 0.441039f, 0.272909f, -0.358182f, -0.411416f, -0.293450f, 0.465857f, -0.222672f, -0.121291f, 0.345039f, 0.217182f, 0.174593f, -0.083083f, 0.072135f, 0.207664f, -0.216061f, 0.177505f, 0.399576f, -0.088423f, -0.074249f, 0.044402f, -0.203038f, -0.126426f, 0.247830f, -0.308436f, -0.306994f, -0.328842f, -0.391593f, 0.112628f, -0.220482f, -0.000755f, -0.014374f, -0.481521f, -0.038114f, -0.246077f, 0.159259f, 0.062484f, -0.219078f, -0.241270f, 0.072840f, -0.188534f, -0.348974f, -0.216888f, 0.044763f, 0.077113f, 0.320205f, 0.289716f, 0.347674f, -0.149030f, -0.217841f, 0.145414f, 0.013173f, -0.256225f, 0.349573f, 0.240006f, 0.278460f, 0.167174f, 0.207414f, 0.247629f, 0.315033f, -0.307404f, -0.050827f, 0.033772f, -0.128949f, 0.292749f, -0.109195f, -0.036396f, -0.313836f, 0.168127f, -0.037422f, 0.174287f, -0.127609f, -0.241806f, 0.236290f, 0.009969f, -0.331641f, -0.085603f, 0.013253f, 0.249191f, 0.163698f, -0.255155f, 0.040836f, 0.084234f, -0.535629f, 0.131435f, 0.012718f, 0.434684f, -0.253705f, -0.236844f, 0.167862f, 0.066130f, -0.418238f, -0.037229f, 0.093316f, 0.535708f, 0.051820f, -0.221076f, -0.817782f, -0.143583f, -0.208603f, -0.187415f, 0.193679f, 0.423252f, 0.007228f, 0.065247f, -0.531361f, -0.263331f, 0.060819f, 0.285180f, 0.017452f, -0.210341f, 0.073808f, -0.124928f, 0.115663f, -0.193966f, 0.088809f, 0.317396f, -0.176417f, -0.301198f, -0.210023f, -0.119655f };
static const float mynet_layer_1_biases[1] = { -0.183618f };
static const float mynet_layer_1_weights[8] = { 0.073266f, -0.315596f, -0.266731f, 0.176381f, -0.279718f, 0.102798f, 0.454833f, 0.395844f };
static float mynet_buf1[18];
static float mynet_buf2[18];
static const EmlNetLayer mynet_layers[2] = { 
{ 8, 18, mynet_layer_0_weights, mynet_layer_0_biases, EmlNetActivationRelu }, 
{ 1, 8, mynet_layer_1_weights, mynet_layer_1_biases, EmlNetActivationIdentity } };
static EmlNet mynet = { 2, mynet_layers, mynet_buf1, mynet_buf2, 18 };

    int32_t
    mynet_predict(const float *features, int32_t n_features)
    {
        return eml_net_predict(&mynet, features, n_features);
    }
    

    int32_t
    mynet_regress(const float *features, int32_t n_features, float *out, int32_t out_length)
    {
        return eml_net_regress(&mynet, features, n_features, out, out_length);
    }
    

    float
    mynet_regress1(const float *features, int32_t n_features)
    {
        return eml_net_regress1(&mynet, features, n_features);
    }
    